"""Whole-body inverse kinematics, ZMP and torques."""

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import Load, inverse_dynamics, joint_torques
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.motion import min_jerk, rest_to_rest, still
from humanoid_motion.robot_model import braced_upper_body
from humanoid_motion.whole_body import (
    require_joint_limits,
    require_torque_limits,
    solve,
)
from humanoid_motion.zmp import margins, zmp_of
from hypothesis import given
from hypothesis import strategies as st


def swaying(robot, stance, reach=0.05, duration=1.5):
    """Motion in which the CoM moves sideways by `reach` [m] and comes to rest."""
    time = np.linspace(0.0, duration, 301)
    y = -0.1 + reach * min_jerk(time, duration)
    joints, base = solve(
        robot,
        upper=braced_upper_body(robot),
        com_xy=np.column_stack([np.full(301, 0.015), y]),
        waist_z=stance.posture.waist_height,
        feet=stance.feet,
    )
    return rest_to_rest(time, joints, base, time)


@given(st.floats(-0.05, 0.05), st.floats(-0.26, 0.02), st.floats(0.50, 0.56))
def test_com_and_soles_are_where_they_should_be(robot, stance, x, y, height):
    """The CoM is right to 0.1 um, soles are level and the base is upright."""
    joints, base = solve(
        robot,
        upper=braced_upper_body(robot),
        com_xy=np.array([x, y]),
        waist_z=height,
        feet=stance.feet,
    )
    q = robot.configuration(base[0], joints[0])
    np.testing.assert_allclose(robot.com(q)[:2], [x, y], atol=1e-7)
    assert base[0, 2] == height
    for side in SIDES:
        position, rotation = robot.frame_pose(q, robot.feet[side].frame)
        np.testing.assert_allclose(position, stance.feet[side], atol=1e-9)
        np.testing.assert_allclose(rotation, np.eye(3), atol=1e-9)


def test_com_out_of_reach_is_an_error(robot, stance):
    """A CoM a metre away is refused, and so is a waist above stretched legs."""
    for com, height in (((0.0, -1.0), 0.56), ((0.0, -0.1), 0.9)):
        with pytest.raises(PostureUnreachable):
            solve(
                robot,
                upper=braced_upper_body(robot),
                com_xy=np.array(com),
                waist_z=height,
                feet=stance.feet,
            )


def test_standing_still_the_zmp_is_under_the_com_and_the_floor_carries_the_weight(robot, stance):
    """Without motion the ZMP lies below the CoM, the force is m g and there is no friction."""
    motion = still(stance.posture.joints, stance.posture.base)
    dynamics = inverse_dynamics(robot, motion)
    np.testing.assert_allclose(dynamics.com[0], stance.posture.com, atol=1e-9)
    np.testing.assert_allclose(dynamics.zmp[0], stance.posture.com[:2], atol=1e-9)
    np.testing.assert_allclose(dynamics.force[0], [0.0, 0.0, robot.mass * GRAVITY], atol=1e-6)
    assert dynamics.friction < 1e-9


def test_floor_force_is_the_mass_times_the_acceleration_of_the_com(robot, stance):
    """Newton, against the CoM differentiated numerically."""
    motion = swaying(robot, stance)
    dynamics = inverse_dynamics(robot, motion)
    com = dynamics.com
    step = motion.time[1] - motion.time[0]
    acceleration = np.gradient(np.gradient(com, step, axis=0), step, axis=0)
    inner = slice(4, -4)
    np.testing.assert_allclose(
        dynamics.force[inner, 1], robot.mass * acceleration[inner, 1], atol=0.3
    )
    # The pendulum's ZMP is a fair first guess of the whole robot's.
    pendulum = com[:, 1] - com[:, 2] / GRAVITY * acceleration[:, 1]
    np.testing.assert_allclose(dynamics.zmp[inner, 1], pendulum[inner], atol=0.01)


def test_a_push_on_the_hand_moves_the_zmp_by_its_lever(robot, stance):
    """F_y at height z shifts the ZMP by F_y z / (m g) towards +y."""
    motion = still(stance.posture.joints, stance.posture.base)
    hand = robot.config.hand_link
    point = robot.frame_position(robot.configuration(motion.base[0], motion.joints[0]), hand)
    load = Load(point=point[None, :], force=np.array([[0.0, 20.0, 0.0]]))
    free, pushed = inverse_dynamics(robot, motion), inverse_dynamics(robot, motion, load)
    shift = pushed.zmp[0, 1] - free.zmp[0, 1]
    assert shift == pytest.approx(20.0 * point[2] / (robot.mass * GRAVITY))
    assert pushed.force[0, 1] == pytest.approx(-20.0)


@pytest.mark.parametrize("sides", [SIDES, ("left",)])
def test_joint_torques_and_foot_forces_balance_the_robot(robot, stance, sides):
    """Virtual work: torques and feet together do the work of gravity for feet that stay put.

    A whole-body motion that keeps the soles still lifts the robot against gravity alone.
    """
    motion = still(stance.posture.joints, stance.posture.base)
    dynamics = inverse_dynamics(robot, motion)
    torque = joint_torques(robot, motion, dynamics, stance.feet, sides)[0]
    lift = 1e-5
    heights = []
    postures = []
    for sign in (1.0, -1.0):
        joints, base = solve(
            robot,
            upper=braced_upper_body(robot),
            com_xy=stance.posture.com[:2],
            waist_z=stance.posture.waist_height + sign * lift,
            feet=stance.feet,
        )
        postures.append(joints[0])
        heights.append(robot.com(robot.configuration(base[0], joints[0]))[2])
    work = torque @ (postures[0] - postures[1])
    assert work == pytest.approx(robot.mass * GRAVITY * (heights[0] - heights[1]), rel=1e-3)


def test_joint_limits_name_joint_phase_value_and_limit(robot, stance):
    """A position out of range, a speed and a torque above their limits are errors."""
    joints = stance.posture.joints.copy()
    joints[3] = np.radians(160.0)
    with pytest.raises(JointLimit, match="RLEG_JOINT3") as caught:
        require_joint_limits(robot, still(joints, stance.posture.base), "shift")
    assert caught.value.phase == "shift"
    assert caught.value.value == pytest.approx(np.radians(160.0))
    assert caught.value.limit[1] == pytest.approx(np.radians(150.0))
    with pytest.raises(JointLimit, match="rad/s"):
        require_joint_limits(robot, swaying(robot, stance, 0.1, duration=0.05), "shift")
    with pytest.raises(JointLimit, match=r"RARM_JOINT1.*N m"):
        require_torque_limits(robot, np.where(np.arange(30) == 17, 500.0, 0.0)[None], "shift")


def test_where_the_floor_does_not_push_there_is_neither_zmp_nor_margin(robot, stance):
    """A sample in the air has a ZMP of NaN and a margin below every limit."""
    force = np.array([[0.0, 0.0, 500.0], [0.0, 0.0, 0.0], [0.0, 0.0, -500.0]])
    points = zmp_of(force, np.zeros((3, 3)))
    np.testing.assert_array_equal(np.isnan(points).any(axis=1), [False, True, True])
    found = margins(robot, points, stance.feet, SIDES)
    assert np.isfinite(found[0])
    np.testing.assert_array_equal(found[1:], [-np.inf, -np.inf])
