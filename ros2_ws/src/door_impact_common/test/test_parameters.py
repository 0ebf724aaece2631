"""Parameters as people give them, and what is refused."""

import math
from pathlib import Path

import pytest
import rclpy
from ament_index_python.packages import get_package_share_directory
from door_impact_common.errors import SettingError
from door_impact_common.parameters import FOLDERS, Parameters, allowed_folders
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


@pytest.fixture
def folders():
    """Makes a node with a value of `allowed_folders`, and returns what it reads."""
    rclpy.init()
    nodes = []

    def read(*given):
        overrides = [Parameter(FOLDERS, value=value) for value in given]
        nodes.append(rclpy.create_node("tested", parameter_overrides=overrides))
        found = allowed_folders(nodes[-1])
        assert nodes[-1].describe_parameter(FOLDERS).read_only
        return found

    yield read
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown()


def test_the_usual_folders_are_those_of_the_user_and_of_the_packages(
        folders, tmp_path, monkeypatch):
    """The parameter shows them; in a development install the sources' data are among them."""
    (tmp_path / "work").mkdir()
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    found = folders()
    assert {tmp_path / "work", tmp_path / "home"} <= set(found)
    share = Path(get_package_share_directory("door_model"))
    for file in (share / "package.xml", share / "doors" / "paper.yaml"):
        assert any(file.resolve().is_relative_to(folder) for folder in found)
    assert not any(tmp_path.is_relative_to(folder) for folder in found)
    assert found == folders("")  # as launch files give it


def test_a_root_folder_is_not_among_the_usual_ones(folders, monkeypatch):
    """Services work in / and may have it as their home."""
    monkeypatch.chdir("/")
    monkeypatch.setenv("HOME", "/")
    assert Path("/") not in folders()


def test_the_given_folders_replace_the_usual_ones(folders, tmp_path, monkeypatch):
    """Relative folders, ~ and links are followed when the node starts; empty texts are left out."""
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert folders(["link", "~/other", ""]) == (tmp_path / "real", tmp_path / "other")
    assert folders(["/"]) == (Path("/"),)


def test_an_empty_list_allows_no_folder(folders):
    """Then only doors of the packages can be named."""
    assert folders([]) == ()


def test_other_values_of_allowed_folders_are_refused(folders):
    """A single text is no list: it would be taken letter by letter."""
    with pytest.raises(SettingError, match="list of folders"):
        folders("/tmp")
