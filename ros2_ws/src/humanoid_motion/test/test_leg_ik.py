"""Closed-form leg inverse kinematics against Pinocchio's forward kinematics."""

import numpy as np
import pytest
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.leg_ik import leg_ik
from hypothesis import given
from hypothesis import strategies as st


def ankle_pose(robot, side, angles):
    """Pose of the ankle in base_link, computed by Pinocchio."""
    joints = np.zeros(30)
    joints[robot.leg_columns[side]] = angles
    return robot.frame_pose(robot.configuration(np.zeros(3), joints), f"{side[0]}_ankle")


@pytest.mark.parametrize("side", ["right", "left"])
@given(angles=st.tuples(*(st.floats(*ends) for ends in (
    (-0.5, 0.5), (-0.5, 0.5), (-1.8, 0.6), (0.02, 2.4), (-1.2, 0.6), (-0.3, 0.3)))))
def test_inverse_undoes_forward(robot, side, angles):
    """The angles found for any pose that the leg can take lead to this pose."""
    position, rotation = ankle_pose(robot, side, np.array(angles))
    found = leg_ik(robot.legs[side], position, rotation)[0]
    again, turned = ankle_pose(robot, side, found)
    np.testing.assert_allclose(again, position, atol=1e-9)
    np.testing.assert_allclose(turned, rotation, atol=1e-9)


@given(st.floats(-0.2, 0.2), st.floats(-0.25, 0.1), st.floats(-0.58, -0.3))
def test_level_foot_goes_where_it_is_told_or_is_refused(robot, x, y, z):
    """A level foot is reached to a nanometre, or the pose is an error: nothing is clipped."""
    target = np.array([x, y, z])
    refused = None
    try:
        found = leg_ik(robot.legs["right"], target)[0]
    except PostureUnreachable as error:
        refused = error
    if refused is not None:
        assert refused.value > refused.limit - 1e-9
        return
    position, rotation = ankle_pose(robot, "right", found)
    np.testing.assert_allclose(position, target, atol=1e-9)
    np.testing.assert_allclose(rotation, np.eye(3), atol=1e-9)


def test_one_unreachable_sample_among_many_is_reported_with_its_distance(robot):
    """A stretch beyond 0.6 m is an error that names value and limit, even by a tenth of a mm."""
    hip_to_ankle = np.array([[0.0, -0.095, -0.5], [0.0, -0.095, -0.6001]])
    with pytest.raises(PostureUnreachable, match="right leg") as caught:
        leg_ik(robot.legs["right"], hip_to_ankle)
    assert caught.value.limit == pytest.approx(0.6)
    assert 0.6 < caught.value.value < 0.6002
