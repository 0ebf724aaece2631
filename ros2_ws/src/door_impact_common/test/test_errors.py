"""The errors that all packages share."""

from door_impact_common.errors import DoorImpactError, SettingError


def test_a_message_is_made_of_quantity_value_and_limit():
    error = DoorImpactError(quantity="angle [deg]", value=95.0, limit="90 or less", phase="hold")
    assert str(error) == "angle [deg] is 95.0, must be 90 or less"
    assert (error.quantity, error.value, error.limit) == ("angle [deg]", 95.0, "90 or less")
    error = SettingError("width", -1.0, "positive")
    assert str(error) == "width is -1.0, must be positive"
    assert error.setting == error.quantity == "width"


def test_the_reason_is_that_of_the_class_unless_one_is_given():
    """Programs read the kind of an error from its reason."""
    assert DoorImpactError("shut", reason="locked").reason == "locked"
    assert DoorImpactError("shut").reason == ""
    assert SettingError("width", -1.0, "positive").reason == "setting"
