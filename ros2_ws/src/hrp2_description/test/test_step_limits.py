"""The limits of footsteps in robot.yaml."""

import math

import pytest
from hrp2_description.data import data_path
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import load_robot_config
from hrp2_description.step_limits import read_step_limits

GOOD = {"ahead": 0.2, "back": 0.15, "width": 0.19, "narrowest": 0.17, "widest": 0.34,
        "turn_deg": 20.0, "clearance": 0.02}


def test_hrp2_has_limits_and_its_width_is_that_of_half_sitting():
    """The feet of half-sitting are 0.19 m apart."""
    limits = load_robot_config().footsteps
    assert limits.width == pytest.approx(0.19)
    assert limits.turn == pytest.approx(math.radians(20.0))


@pytest.mark.parametrize(("change", "word"), [
    ({"clearance": math.nan}, "clearance"), ({"width": 0.4}, "narrowest to widest")])
def test_limits_that_cannot_be_are_refused(change, word):
    """The error names the limit."""
    with pytest.raises(RobotConfigError, match=word):
        read_step_limits({**GOOD, **change})


def test_a_joint_of_the_chest_that_the_urdf_does_not_have_is_refused(tmp_path):
    """The error names it."""
    source = data_path("config/robot.yaml")
    other = tmp_path / "robot.yaml"
    text = source.read_text().replace("chest_yaw: CHEST_JOINT0", "chest_yaw: CHEST_JOINT7")
    other.write_text(text.replace(
        "urdf: urdf/hrp2.urdf", f"urdf: {data_path('urdf/hrp2.urdf')}"))
    with pytest.raises(RobotConfigError, match="CHEST_JOINT7"):
        load_robot_config(other)
