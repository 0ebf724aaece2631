"""Base and feet that are turned about the vertical."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hrp2_description.robot import SIDES
from humanoid_motion.clearance import LeafCourse, bodies_of
from humanoid_motion.dynamics import Load, inverse_dynamics, joint_torques
from humanoid_motion.motion import BaseYaw, min_jerk_course, rest_to_rest, still
from humanoid_motion.robot_model import braced_upper_body
from humanoid_motion.whole_body import solve
from humanoid_motion.zmp import margins
from hypothesis import given
from hypothesis import strategies as st

ANGLES = st.floats(-7.0, 7.0)
TURNS = st.floats(-0.3, 0.3)


def turned(vectors, yaw):
    """Turn x and y of vectors (..., 2 or 3) about z."""
    out = np.array(vectors, dtype=float)
    cos, sin = np.cos(yaw), np.sin(yaw)
    out[..., 0] = cos * vectors[..., 0] - sin * vectors[..., 1]
    out[..., 1] = sin * vectors[..., 0] + cos * vectors[..., 1]
    return out


@pytest.fixture(scope="module")
def swaying(robot, stance):
    """A sideways sway without a turn."""
    time = np.linspace(0.0, 0.8, 41)
    y = -0.15 + 0.1 * min_jerk_course(time, 0.8)[0]
    joints, base = solve(
        robot, upper=braced_upper_body(robot), com_xy=np.column_stack([0.0 * y + 0.015, y]),
        waist_z=stance.posture.waist_height, feet=stance.feet)
    return rest_to_rest(time, joints, base, time)


def turned_motion(motion, yaw):
    """Return the same motion in a world that is turned by yaw."""
    zero = np.zeros(len(motion))
    return replace(
        motion, base=turned(motion.base, yaw), base_speed=turned(motion.base_speed, yaw),
        base_acceleration=turned(motion.base_acceleration, yaw),
        base_yaw=BaseYaw(zero + yaw, zero, zero))


@given(TURNS, TURNS, ANGLES)
def test_turned_soles_and_com_are_where_they_should_be(robot, stance, left, right, yaw):
    """Soles have their place and heading, the CoM its place, and the base its heading."""
    feet = {side: turned(stance.feet[side], yaw) for side in SIDES}
    feet_yaw = {"left": yaw + left, "right": yaw + right}
    com = turned(np.array([0.01, -0.12]), yaw)
    joints, base = solve(
        robot, upper=braced_upper_body(robot), com_xy=com, waist_z=0.55, feet=feet,
        base_yaw=yaw, feet_yaw=feet_yaw)
    q = robot.configuration(base[0], joints[0], yaw)
    np.testing.assert_allclose(robot.com(q)[:2], com, atol=1e-7)
    for side in SIDES:
        position, rotation = robot.frame_pose(q, robot.feet[side].frame)
        np.testing.assert_allclose(position, feet[side], atol=1e-9)
        wanted = np.array(pin.utils.rotate("z", feet_yaw[side]))
        np.testing.assert_allclose(rotation, wanted, atol=1e-9)
        chain = robot.leg_chains[side].place(joints, base, np.array([yaw]))
        np.testing.assert_allclose(chain.end[0], feet[side], atol=1e-9)


@given(ANGLES)
def test_dynamics_do_not_depend_on_the_heading(robot, stance, swaying, yaw):
    """In a turned world forces are turned, and ZMP margins and torques are the same."""
    point = np.tile([0.3, -0.5, 0.9], (len(swaying), 1))
    push = np.tile([5.0, 20.0, -3.0], (len(swaying), 1))
    there = turned_motion(swaying, yaw)
    one = inverse_dynamics(robot, swaying, Load(point, push))
    two = inverse_dynamics(robot, there, Load(turned(point, yaw), turned(push, yaw)))
    np.testing.assert_allclose(two.com, turned(one.com, yaw), atol=1e-9)
    np.testing.assert_allclose(two.force, turned(one.force, yaw), atol=1e-7)
    np.testing.assert_allclose(two.zmp, turned(one.zmp, yaw), atol=1e-9)
    np.testing.assert_allclose(two.moment_z, one.moment_z, atol=1e-7)
    np.testing.assert_allclose(two.torque, one.torque, atol=1e-7)
    feet = {side: turned(stance.feet[side], yaw) for side in SIDES}
    yaws = dict.fromkeys(SIDES, yaw)
    np.testing.assert_allclose(
        margins(robot, two.zmp, feet, SIDES, yaws), margins(robot, one.zmp, stance.feet, SIDES),
        atol=1e-7)
    np.testing.assert_allclose(
        joint_torques(robot, there, two, feet, SIDES, yaws),
        joint_torques(robot, swaying, one, stance.feet, SIDES), atol=1e-6)


@given(TURNS, st.floats(-3.0, 3.0), st.floats(-8.0, 8.0))
def test_the_floors_moment_is_the_rate_of_the_angular_momentum(
    robot, swaying, yaw, speed, acceleration
):
    """Euler's law for a base that turns faster and faster while the joints move."""
    time = swaying.time - swaying.time[20]
    motion = replace(swaying, base_yaw=BaseYaw(
        yaw + speed * time + 0.5 * acceleration * time**2, speed + acceleration * time,
        np.full(len(time), acceleration)))
    dynamics = inverse_dynamics(robot, motion)
    momenta = []
    for row in range(18, 23):
        angle = motion.base_yaw.angle[row]
        q = robot.configuration(motion.base[row], motion.joints[row], angle)
        v = robot.velocity(turned(motion.base_speed[row], -angle), motion.joint_speed[row])
        v[5] = motion.base_yaw.speed[row]
        momenta.append(np.array(pin.computeCentroidalMomentum(robot.model, robot.data, q, v)))
    step = time[1] - time[0]
    rate = (np.array(momenta[0]) - 8 * momenta[1] + 8 * momenta[3] - momenta[4]) / (12 * step)
    force = dynamics.force[20] - [0.0, 0.0, robot.mass * 9.80665]
    np.testing.assert_allclose(rate[:3], force, atol=0.05)
    arm = np.append(dynamics.zmp[20], 0.0) - dynamics.com[20]
    about_com = np.cross(arm, dynamics.force[20]) + [0.0, 0.0, dynamics.moment_z[20]]
    np.testing.assert_allclose(rate[3:], about_com, atol=0.05)


@given(st.floats(-0.5, 0.5), st.floats(-1.0, 1.0))
def test_a_turning_base_comes_as_near_to_the_leaf_as_its_samples_show(
    robot, swaying, begin, turn
):
    """The search over a turning motion finds what every sample, turned back, finds alone."""
    bodies = bodies_of(robot)
    yaw = begin + turn * swaying.time
    motion = replace(swaying, base_yaw=BaseYaw(yaw, 0.0 * yaw, 0.0 * yaw))
    leaf = LeafCourse(np.array([-0.4, -0.75]), np.full(len(yaw), 0.3), 0.9)
    found = bodies.leaf_clearance(motion, leaf, 0.01)
    alone = []
    for row in range(0, len(yaw), 4):
        # The leaf seen from the base: the hinge turned back about the base, the angle more open.
        hinge = turned(leaf.hinge - motion.base[row, :2], -yaw[row]) + motion.base[row, :2]
        at_row = LeafCourse(hinge, np.array([0.3 + yaw[row]]), 0.9)
        here = still(motion.joints[row], motion.base[row])
        alone.append(bodies.leaf_clearance(here, at_row, 0.01).distance)
    assert found.distance <= min(alone) + 1e-5
    assert found.distance >= min(alone) - 0.01  # between these samples it may come nearer
