"""Geometry of the brace's pads."""

import numpy as np
import pinocchio as pin
import pytest
from humanoid_motion.pads import normal_and_tangents, pad_contact
from humanoid_motion.robot_model import braced_upper_body
from hypothesis import given
from hypothesis import strategies as st

STEP = 1e-6  # step of finite differences


@pytest.fixture(scope="module")
def braced(robot):
    """The braced robot's configuration above the origin."""
    return robot.configuration(np.array([0.1, -0.2, 0.6]), braced_upper_body(robot))


def test_the_jacobian_is_the_velocity_of_the_touching_material(robot, braced):
    """In every direction, the points of arm and trunk that touch move apart as it says."""
    brace = robot.config.brace
    found = pad_contact(robot, braced, brace)
    ball, turn = robot.frame_pose(braced, brace.arm.link)
    point = ball + turn @ np.array(brace.arm.place) - brace.arm.size * found.axes[0]
    own = {}
    for pad in (brace.arm, brace.trunk):
        place, turn = robot.frame_pose(braced, pad.link)
        own[pad.link] = turn.T @ (point - place)

    def apart(q):
        poses = {link: robot.frame_pose(q, link) for link in own}
        arm, trunk = (poses[pad.link][0] + poses[pad.link][1] @ own[pad.link]
                      for pad in (brace.arm, brace.trunk))
        return found.axes @ (arm - trunk)

    for column in range(robot.model.nv):
        move = np.zeros(robot.model.nv)
        move[column] = STEP
        slope = apart(pin.integrate(robot.model, braced, move)) / STEP
        np.testing.assert_allclose(slope, found.jacobian[:, column], atol=1e-5)


@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).filter(
    lambda each: np.linalg.norm(each) > 0.1))
def test_normal_and_tangents_are_a_rotation(direction):
    """The rows are orthonormal and right-handed, and the first is the normal."""
    normal = np.array(direction) / np.linalg.norm(direction)
    axes = normal_and_tangents(normal)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(axes[0], normal)
    assert np.linalg.det(axes) == pytest.approx(1.0)
