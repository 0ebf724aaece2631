"""Inverse kinematics of legs against Pinocchio's forward kinematics, and against each other."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hrp2_description.data import share_folders
from hrp2_description.errors import RobotConfigError
from humanoid_motion.chain import yaw_matrices
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.leg_ik import leg_geometry, leg_ik
from humanoid_motion.numerical_leg import NumericalLeg, leg_of
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


def numerical(robot, side):
    """HRP-2's leg, as one of any kind."""
    columns = robot.leg_columns[side]
    return NumericalLeg(f"{side} leg", robot.model, robot.config.legs[side],
                        robot.config.half_sitting[columns])


@pytest.mark.parametrize("side", ["right", "left"])
def test_newtons_method_finds_what_the_closed_form_finds_and_reaches_no_farther(robot, side):
    """Around half-sitting, for feet that are turned and for many poses at once."""
    rng, leg = np.random.default_rng(3), numerical(robot, side)
    columns = robot.leg_columns[side]
    middle = ankle_pose(robot, side, robot.config.half_sitting[columns])[0]
    places = middle + rng.uniform([-0.2, -0.1, -0.08], [0.2, 0.1, 0.2], (500, 3))
    turns = yaw_matrices(rng.uniform(-0.3, 0.3, 500))
    closed, found = (each.solve(places, turns, strict=False) for each in (robot.legs[side], leg))
    reached = np.isfinite(closed).all(axis=1)
    assert 300 < reached.sum() < 500
    np.testing.assert_allclose(found[reached], closed[reached], atol=1e-7)
    assert np.isnan(found[~reached]).any(axis=1).all()
    with pytest.raises(PostureUnreachable, match=f"{side} leg: it does not reach a pose"):
        leg.solve(places, turns)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_leg_with_offsets_and_a_tilted_axis_is_solved(side):
    """The Unitree G1's hip: pitch, roll, yaw, which do not meet; the closed form refuses it."""
    (folder, *_) = filter(Path.is_dir, share_folders("example-robot-data"))
    urdf = folder / "robots" / "g1_description" / "urdf" / "g1_29dof_rev_1_0.urdf"
    model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    names = [f"{side}_{joint}_joint" for joint in (
        "hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")]
    start = np.array([-0.3, 0.0, 0.0, 0.6, -0.3, 0.0])
    with pytest.raises(RobotConfigError, match="is not the hip yaw"):
        leg_geometry(model, side, names)
    leg, data = leg_of(model, side, names, start), model.createData()
    rng = np.random.default_rng(4)
    columns = [model.idx_qs[model.getJointId(name)] for name in names]
    poses = []
    for angles in start + rng.uniform(-0.25, 0.25, (200, 6)):
        q = pin.neutral(model)
        q[columns] = angles
        pin.forwardKinematics(model, data, q)
        poses.append((angles, data.oMi[model.getJointId(names[-1])].copy()))
    found = leg.solve(np.array([pose.translation for _, pose in poses]),
                      np.array([pose.rotation for _, pose in poses]))
    np.testing.assert_allclose(found, [angles for angles, _ in poses], atol=1e-8)
    assert leg.length == pytest.approx(0.6, abs=0.15)
