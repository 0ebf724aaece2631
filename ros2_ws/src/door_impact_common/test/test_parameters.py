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


@pytest.mark.parametrize(("given", "read", "found"), [
    (2, lambda p: p.number("value"), 2.0),
    (math.nan, lambda p: math.isnan(p.number("value", unknown=True)), True),
    (1, lambda p: p.switch("value"), True),
    ("false", lambda p: p.switch("value"), False),
    ("one", lambda p: p.choice("value", ("one", "two")), "one")])
def test_a_value_may_come_as_people_type_it(reading, given, read, found):
    assert read(reading(given)) == found


@pytest.mark.parametrize(("given", "read", "limit"), [
    ("2.0", lambda p: p.number("value"), "finite"),
    (math.nan, lambda p: p.number("value"), r"config/params\.yaml"),
    (math.inf, lambda p: p.number("value", unknown=True), "a finite number"),
    (2, lambda p: p.number("value", 3.0, 4.0), "from 3 to 4"),
    (2.5, lambda p: p.whole("value"), "whole"),
    ("other", lambda p: p.choice("value", ("one", "two")), "one or two")])
def test_another_value_is_refused_with_the_parameters_name_and_what_it_must_be(
        reading, given, read, limit):
    with pytest.raises(SettingError, match=limit) as caught:
        read(reading(given))
    assert caught.value.setting == "value"


def test_a_fixed_parameter_cannot_be_set_and_a_free_one_can(reading):
    for read_only in (True, False):
        parameters = reading(1.0, read_only=read_only)
        result = parameters._node.set_parameters([Parameter("value", value=2.0)])[0]
        assert result.successful is not read_only
        assert parameters.number("value") == (1.0 if read_only else 2.0)
