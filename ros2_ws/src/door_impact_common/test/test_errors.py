"""The errors that all packages share."""

import pytest
from door_impact_common.errors import DoorImpactError, OutputError, SettingError


def test_a_message_is_made_of_quantity_value_and_limit():
    """An error without a text of its own says what is wrong, and by which limit."""
    error = DoorImpactError(quantity="angle [deg]", value=95.0, limit="90 or less", phase="hold")
    assert str(error) == "angle [deg] is 95.0, must be 90 or less"
    assert (error.quantity, error.value, error.limit) == ("angle [deg]", 95.0, "90 or less")
    assert error.phase == "hold"


def test_a_text_of_its_own_is_kept_as_it_is():
    """A message that is given replaces the one that is made."""
    error = DoorImpactError("the door is shut", quantity="angle [deg]", value=0.0, limit=1.0)
    assert str(error) == "the door is shut"
    assert error.limit == 1.0


def test_the_reason_is_that_of_the_class_unless_one_is_given():
    """Programs read the kind of an error from its reason."""
    assert DoorImpactError("shut").reason == ""
    assert DoorImpactError("shut", reason="locked").reason == "locked"
    assert DoorImpactError("shut").reason == ""
    assert SettingError("width", -1.0, "positive").reason == "setting"


def test_a_setting_error_names_the_setting():
    """The name of the setting is in the message and in two attributes."""
    error = SettingError("width", -1.0, "positive")
    assert str(error) == "width is -1.0, must be positive"
    assert error.setting == error.quantity == "width"


@pytest.mark.parametrize("error", [SettingError("width", 0, "positive"), OutputError("full")])
def test_every_error_is_a_door_impact_error(error):
    """Nodes and commands show errors of this base in one line."""
    assert isinstance(error, DoorImpactError)
