"""The stance of a reference whose feet are turned."""

import math

import numpy as np
import pytest
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.control.stance_reference import ReferenceStanceModel
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.spline import JointReference
from humanoid_motion.whole_body import solve
from hypothesis import given
from hypothesis import strategies as st

TURNS = st.floats(-0.25, 0.25)
COM = np.array([0.012, 0.01])


@pytest.fixture(scope="module")
def model(robot):
    """The robot's kinematics."""
    return RobotModel(robot)


def turned_posture(model, left, right, lifts=(0.0, 0.0)):
    """Return joints and base with the soles turned by left and right [rad] and lifted [m]."""
    feet = {side: np.array([0.0, y, lift])
            for side, y, lift in zip(SIDES, (0.11, -0.11), lifts, strict=True)}
    return solve(
        model, upper=model.config.half_sitting, com_xy=COM, waist_z=0.62, feet=feet,
        base_yaw=0.5 * (left + right), feet_yaw={"left": left, "right": right})


def stance_of(robot, joints):
    return ReferenceStanceModel(robot).at(JointReference(joints, np.zeros(30), np.zeros(30)))


@given(TURNS, TURNS)
def test_the_level_frame_points_in_the_mean_heading_of_the_soles(robot, model, left, right):
    """It is base_link's own heading, with the soles turned half their angle to either side."""
    joints, base = turned_posture(model, left, right)
    stance = stance_of(robot, joints[0])
    half = 0.5 * (left - right)
    for turn, yaw in zip(stance.turns, (half, -half), strict=True):
        assert math.atan2(turn[1, 0], turn[0, 0]) == pytest.approx(yaw, abs=2e-6)
    mean = 0.5 * (left + right)
    cos, sin = math.cos(mean), math.sin(mean)
    com = np.array([[cos, sin], [-sin, cos]]) @ (COM - base[0, :2])
    np.testing.assert_allclose(stance.com[:2], com, atol=1e-6)
    np.testing.assert_allclose(stance.zmp, com, atol=1e-6)


@given(TURNS, TURNS)
def test_the_level_frame_does_not_jump_when_the_other_sole_is_lower(robot, model, left, right):
    """A foot that leaves the floor by a hair changes neither axes nor ZMP."""
    hair = 1e-7
    found = [stance_of(robot, turned_posture(model, left, right, lifts)[0][0])
             for lifts in ((hair, 0.0), (0.0, hair))]
    np.testing.assert_allclose(found[0].turns, found[1].turns, atol=1e-5)
    np.testing.assert_allclose(found[0].centers, found[1].centers, atol=1e-5)
    np.testing.assert_allclose(found[0].zmp, found[1].zmp, atol=1e-5)


def test_parallel_soles_leave_the_lower_soles_axes_as_they_are(robot):
    """In a hit nothing is turned, so that its commands are the same bit for bit."""
    stance = stance_of(robot, robot.half_sitting)
    lower = int(stance.turns[1, 0, 0] != 1.0)
    np.testing.assert_allclose(stance.turns[lower], np.eye(3), atol=1e-15)
