"""Errors pass from one process to another, as a sweep's workers send them."""

import pickle

import pytest
from door_impact_common.errors import DoorImpactError, SettingError
from hrp2_description.errors import RobotConfigError
from hrp2_sim_bridge.errors import DivergedError, SimulatorMissingError, TrajectoryRefusedError

ERRORS = [
    DivergedError("PyBullet", 0.123), SettingError("door_distance", -1.0, "above 0"),
    TrajectoryRefusedError("speed [rad/s]", "RLEG_JOINT3", 9.0, 4.0),
    RobotConfigError("step", value=1, limit=2), SimulatorMissingError("MuJoCo", "pip"),
    DoorImpactError(quantity="angle [rad]", value=2.0, limit=1.0, reason="too_far"),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_is_the_same_on_the_other_side(error: DoorImpactError) -> None:
    """Class, message, value, limit and reason are kept."""
    other = pickle.loads(pickle.dumps(error))
    assert type(other) is type(error)
    assert str(other) == str(error)
    assert (other.value, other.limit, other.reason) == (error.value, error.limit, error.reason)
