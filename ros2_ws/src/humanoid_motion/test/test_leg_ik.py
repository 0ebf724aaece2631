"""Closed-form leg inverse kinematics against Pinocchio's forward kinematics."""

import numpy as np
import pinocchio as pin
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
@given(
    angles=st.tuples(
        st.floats(-0.5, 0.5),
        st.floats(-0.5, 0.5),
        st.floats(-1.8, 0.6),
        st.floats(0.02, 2.4),
        st.floats(-1.2, 0.6),
        st.floats(-0.3, 0.3),
    )
)
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


def test_many_samples_are_each_the_single_answer(robot):
    """Many poses at once give the same angles as each pose alone."""
    rng = np.random.default_rng(3)
    targets = np.array([0.0, -0.1, -0.45]) + 0.03 * rng.standard_normal((50, 3))
    together = leg_ik(robot.legs["right"], targets)
    alone = np.vstack([leg_ik(robot.legs["right"], target) for target in targets])
    np.testing.assert_array_equal(together, alone)


def test_legs_are_mirror_images(robot):
    """Mirroring the target mirrors rolls and yaw and keeps pitches."""
    right = leg_ik(robot.legs["right"], [0.02, -0.17, -0.5])[0]
    left = leg_ik(robot.legs["left"], [0.02, 0.17, -0.5])[0]
    np.testing.assert_allclose(left, right * [-1, -1, 1, 1, 1, -1], atol=1e-12)


def test_one_unreachable_sample_among_many_is_reported_with_its_distance(robot):
    """A stretch beyond 0.6 m is an error that names value and limit, even by a tenth of a mm."""
    hip_to_ankle = np.array([[0.0, -0.095, -0.5], [0.0, -0.095, -0.6001]])
    with pytest.raises(PostureUnreachable, match="right leg") as caught:
        leg_ik(robot.legs["right"], hip_to_ankle)
    assert caught.value.limit == pytest.approx(0.6)
    assert 0.6 < caught.value.value < 0.6002


def test_nan_is_an_error(robot):
    """A position that is NaN raises an error instead of giving angles that are NaN."""
    with pytest.raises(PostureUnreachable, match="not a number"):
        leg_ik(robot.legs["right"], [np.nan, 0.0, -0.5])


def test_pinocchio_reads_the_robot_s_order(robot):
    """Each column of the joints sets the joint of its name."""
    q = robot.configuration(np.zeros(3), np.arange(30) / 100.0)
    for i, name in enumerate(robot.joint_names):
        joint = robot.model.joints[robot.model.getJointId(name)]
        assert q[joint.idx_q] == pytest.approx(i / 100.0)
    assert pin.computeTotalMass(robot.model) == pytest.approx(58.0, abs=1e-6)
