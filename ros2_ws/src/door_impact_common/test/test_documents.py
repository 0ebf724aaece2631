"""Documents are checked against their description; every fault is one sentence with its place."""

import math

import pytest
from door_impact_common.documents import Name, Part, Positive, Range, checked, descriptions, number
from door_impact_common.errors import SettingError
from pydantic.dataclasses import dataclass


class Leaf(Part):
    width: Positive


class Door(Part):
    name: Name
    leaf: Leaf | None = None
    heights: Range = (0.0, 1.0)


@dataclass
class Settings:
    margin: float = number(0.02, 0.0, 0.1, "a margin [m]")
    start: float | None = number(None, -1.0, 1.0, "a start [m]")
    own: int = 3


def test_a_document_becomes_what_describes_it():
    """An integer is a number; what is left out has its default."""
    door = checked(Door, {"name": "paper", "leaf": {"width": 1}})
    assert (door.leaf.width, door.heights) == (1.0, (0.0, 1.0))


@pytest.mark.parametrize(("document", "place", "value", "limit"), [
    ({"leaf": {"width": 1}}, "name", "missing", "given"),
    ({"name": "a", "leaf": {"width": -1}}, "leaf.width", -1, "above 0"),
    ({"name": "a", "leaf": {"width": True}}, "leaf.width", True, "a number"),
    ({"name": "a", "leaf": {"width": math.nan}}, "leaf.width", math.nan, "a finite number"),
    ({"name": "a", "leaf": {"widht": 1, "width": 1}}, "leaf.widht", "unknown",
     "a known key, such as width"),
    ({"name": "a", "heights": [2, 1]}, "heights", "[2, 1]", "two numbers, the lower one first"),
    ([1], "the document", "[1]", "a mapping of keys")])
def test_a_fault_has_place_value_and_limit(document, place, value, limit):
    """The message is those three; a long value is shortened."""
    with pytest.raises(SettingError) as caught:
        checked(Door, document)
    assert (caught.value.setting, caught.value.limit) == (place, limit)
    assert caught.value.value == value or caught.value.value != caught.value.value  # NaN


def test_fields_with_a_meaning_are_parameters():
    """None is NaN, because a parameter of ROS 2 has one type."""
    found = descriptions(Settings)
    assert found.pop("margin") == (0.02, "a margin [m]")
    assert math.isnan(found.pop("start")[0])
    assert not found
