"""Force sensors of the feet, wherever they are and whatever they report."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import load_robot_config
from hrp2_description.robot_types import FootNames
from hrp2_description.robot_types import FootSensors as Kind
from humanoid_motion.robot_model import RobotModel
from hypothesis import given
from hypothesis import strategies as st
from robot_driver.foot_sensors import FootSensors

ROBOT, NONE = RobotModel(load_robot_config()), np.zeros(6)
numbers = st.lists(st.floats(-500.0, 500.0), min_size=6, max_size=6).map(np.array)
BELOW = 0.2 * GRAVITY * np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])  # HRP-2's sole bears itself [N]


def sensors(offset=NONE, robot=ROBOT.config, **kind) -> FootSensors:
    model = RobotModel(replace(robot, foot_sensors=Kind(**kind)))
    return FootSensors(model, {"left": offset, "right": NONE})


@given(numbers, numbers, st.sampled_from(["l_sole", "l_ankle", "r1/l_ankle", "", "my_sensor"]),
       st.booleans(), st.booleans())
def test_what_the_floor_does_to_the_sole_is_found_again(true, offset, frame, compensated, turned):
    """From an ankle's frame, with the sole's own weight, an offset, and the opposite sign."""
    name = frame.rpartition("/")[2]
    level = true - (0.0 if compensated else BELOW)
    model = ROBOT.model
    sole, placed = (model.frames[model.getFrameId(each if model.existFrame(each) else "l_sole")]
                    for each in ("l_sole", name))
    there = placed.placement.actInv(sole.placement).act(pin.Force(level[:3], level[3:])).vector
    found = sensors(offset, compensated=compensated, reversed=turned).at_sole(
        "left", frame, (-there if turned else there) + offset)
    np.testing.assert_allclose(found, true, atol=1e-9)


def test_a_frame_of_another_foot_is_refused_with_its_name() -> None:
    assert "frame_id is r_sole, which is not fixed to l_sole" in sensors().at_sole(
        "left", "r_sole", np.zeros(6))


def test_an_offset_is_the_mean_of_a_foot_in_the_air_that_is_held_still() -> None:
    """What is told as the offset gives zero; a foot that swings gives a sentence."""
    raw, found = np.array([3.0, -2.0, 45.0, 1.0, 2.0, -0.5]), sensors(compensated=False)
    assert "only 0 readings" in found.offset("left")
    for _ in range(60):
        found.at_sole("left", "l_ankle", raw)
    again = sensors(found.offset("left"), compensated=False)
    np.testing.assert_allclose(again.at_sole("left", "l_ankle", raw), 0.0, atol=1e-9)
    for number in range(60):
        found.at_sole("left", "l_ankle", raw + 20.0 * np.sin(number))
    assert "vary by 14" in found.offset("left")


def test_weight_that_counts_needs_to_be_known() -> None:
    bare = replace(ROBOT.config, feet={side: FootNames(names.sole) for side, names in
                                       ROBOT.config.feet.items()})
    with pytest.raises(RobotConfigError, match="sensor_joint of the left foot"):
        sensors(robot=bare, compensated=False)
