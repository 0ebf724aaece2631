"""Where a walk begins: wherever the robot stands on two feet, and nowhere else."""

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from humanoid_motion.kinematics import yaw_of
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from motion_execution.walk.start import Standing, require_near, soles_at, start_state
from walking.errors import NotReady
from walking.footsteps.footstep import Pose
from walking.pattern.fold import plan_fold
from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings

PATTERN = WalkSettings()


@pytest.fixture(scope="session")
def still(robot):
    """A robot that stands in half-sitting with its base over the origin."""
    half = np.array(robot.config.half_sitting)
    return Standing(Pose(0.0, 0.0, 0.0), 0.0, half, np.zeros(len(half)))


@given(x=st.floats(-20.0, 20.0), y=st.floats(-20.0, 20.0), yaw=st.floats(-4.0, 4.0),
       noise=arrays(float, 30, elements=st.floats(-0.01, 0.01)))
def test_motors_that_hold_a_posture_badly_do_not_change_it(robot, still, x, y, yaw, noise):
    """The walk begins in half-sitting with the feet where the odometry has them, within 3 cm."""
    found = replace(still, base=Pose(x, y, yaw), position=still.position + noise)
    state = start_state(robot, found, PATTERN)
    assert np.array_equal(state.upper.value, robot.config.half_sitting)
    exact = start_state(robot, replace(found, position=still.position), PATTERN)
    for side in ("left", "right"):
        off = state.stance.foot(side).seen_from(exact.stance.foot(side))
        assert math.hypot(off.x, off.y) < 0.03
        assert abs(off.yaw) < 0.06
    middle = exact.stance.middle.seen_from(Pose(x, y, yaw))
    assert middle.y == pytest.approx(0.0, abs=1e-9)


def test_an_arm_that_a_hit_left_elsewhere_stays_there(robot, still):
    """The first posture of the walk is the measured one, to 2 mrad."""
    position = still.position.copy()
    arm = [robot.joint_names.index(name) for name in ("RARM_JOINT0", "RARM_JOINT3")]
    position[arm] += 0.3
    state = start_state(robot, replace(still, position=position), PATTERN)
    first = plan_walk(robot, state, []).knots.position[0]
    assert np.abs(first - position).max() < 2e-3
    require_near(robot, first, position)


def test_folding_ends_in_half_sitting_from_any_reach(robot, still):
    """It begins where the arm is, and the soles stay."""
    position = still.position.copy()
    position[[robot.joint_names.index(f"RARM_JOINT{n}") for n in (0, 3)]] += (-1.0, -0.5)
    state = start_state(robot, replace(still, position=position), PATTERN)
    fold = plan_fold(robot, state, PATTERN)
    first, last = fold.knots.position[[0, -1]]
    assert np.abs(first - position).max() < 2e-3
    assert np.abs(last - still.position).max() < 1e-3
    assert (fold.checks.margin > 0.03).all()


def test_a_walk_that_was_stopped_between_two_steps_is_gone_on_with(robot, walk_to):
    """The twisted chest of a robot whose feet are apart is no other posture."""
    plan = walk_to(0.8, 0.0, 0.0)
    rest = plan_walk(robot, plan.boundaries[2], [])
    joints = rest.knots.position[-1]
    assert abs(rest.stance.left.x - rest.stance.right.x) > 0.1
    found = Standing(Pose(*rest.motion.base[-1, :2], 0.0), 0.0, joints, np.zeros(len(joints)))
    state = start_state(robot, found, PATTERN)
    assert np.array_equal(state.upper.value, robot.config.half_sitting)
    assert np.abs(plan_walk(robot, state, []).knots.position[0] - joints).max() < 1e-4


@pytest.mark.parametrize(("change", "match"), [
    ({"tilt": math.radians(4.0)}, "fallen"), ({"tilt": math.nan}, "fallen"),
    ({"velocity": ("RLEG_JOINT4", -0.5)}, "RLEG_JOINT4"),
    ({"position": ("LLEG_JOINT4", 0.2)}, "left sole")])
def test_a_robot_that_moves_or_does_not_stand_flat_does_not_walk(robot, still, change, match):
    """The refusal names what is wrong."""
    (name, value), = change.items()
    if name != "tilt":
        joint, off = value
        value = getattr(still, name).copy()
        value[robot.joint_names.index(joint)] += off
    with pytest.raises(NotReady, match=match) as refused:
        start_state(robot, replace(still, **{name: value}), PATTERN)
    assert refused.value.limit > 0.0


def test_a_joint_far_from_the_first_posture_is_named(robot, still):
    """A walk would begin with a jump."""
    first = still.position.copy()
    first[7] += 0.2
    with pytest.raises(NotReady, match=robot.joint_names[7]):
        require_near(robot, first, still.position)


def test_soles_of_a_leaning_robot_are_where_it_stands(robot):
    """Whatever heading the IMU has; as if upright, they would be 20 mm away."""
    frames = [robot.feet[side].frame for side in ("left", "right")]
    half, place = np.array(robot.config.half_sitting), np.array([3.0, -2.0, 0.65])
    *poses, imu = robot.poses_in_base(half, [*frames, robot.config.imu_frame])
    turn = pin.rpy.rpyToMatrix(0.03, -0.02, 1.7)
    attitude = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, -0.7) @ turn @ imu[:3, :3]).coeffs()
    soles = soles_at(robot, Pose(*place[:2], yaw_of(turn)), half, attitude)
    for sole, pose in zip((soles.left, soles.right), poses, strict=True):
        np.testing.assert_allclose(sole[:2], (place + turn @ pose[:3, 3])[:2], atol=1e-9)
        assert sole.yaw == pytest.approx(yaw_of(turn @ pose[:3, :3]))
