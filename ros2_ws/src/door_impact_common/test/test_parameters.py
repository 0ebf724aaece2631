"""Parameters as people give them, and what is refused."""

import math

import pytest
import rclpy
from door_impact_common.errors import SettingError
from door_impact_common.parameters import Parameters
from rclpy.parameter import Parameter

TABLE = {"value": (1.5, "a number"), "other": ("word", "another")}


@pytest.fixture
def reading():
    """Makes a node whose parameter `value` was given on the command line, and reads it."""
    rclpy.init()
    nodes = []

    def read(given, **options):
        overrides = [Parameter("value", value=given)]
        nodes.append(rclpy.create_node("tested", parameter_overrides=overrides))
        return Parameters(nodes[-1], TABLE, **options)

    yield read
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown()


@pytest.mark.parametrize(("given", "number"), [(2, 2.0), (2.5, 2.5)])
def test_a_number_may_come_as_an_integer(reading, given, number):
    """Users type 2 for 2.0."""
    assert reading(given).number("value") == number


@pytest.mark.parametrize("given", ["2.0", math.nan])
def test_what_is_no_finite_number_is_refused_by_name(reading, given):
    """Booleans, texts, lists, NaN and infinity are errors that name the parameter."""
    with pytest.raises(SettingError, match="finite") as caught:
        reading(given).number("value")
    assert caught.value.setting == "value"


def test_a_number_out_of_its_range_is_refused_with_the_range(reading):
    """The message gives the value and the range."""
    with pytest.raises(SettingError, match="from 3 to 4"):
        reading(2).number("value", 3.0, 4.0)


def test_what_is_no_whole_number_is_refused(reading):
    """Fractions are errors."""
    with pytest.raises(SettingError):
        reading(2.5).whole("value")


@pytest.mark.parametrize(("given", "on"), [(True, True), (1, True), ("false", False)])
def test_a_switch_may_come_as_a_word_or_a_number(reading, given, on):
    """true, 1 and their opposites are accepted in each spelling."""
    assert reading(given).switch("value") is on


def test_an_unknown_word_is_refused_with_those_that_are_known(reading):
    """The message lists the words that are accepted."""
    with pytest.raises(SettingError, match="one or two"):
        reading("other").choice("value", ("one", "two"))
    assert reading("one").choice("value", ("one", "two")) == "one"


def test_a_fixed_parameter_cannot_be_set_and_a_free_one_can(reading):
    """A read-only parameter keeps its value when the node runs."""
    for read_only in (True, False):
        parameters = reading(1.0, read_only=read_only)
        result = parameters._node.set_parameters([Parameter("value", value=2.0)])[0]
        assert result.successful is not read_only
        assert parameters.number("value") == (1.0 if read_only else 2.0)
