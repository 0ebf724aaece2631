import math
from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.control.stabilizer import Stabilizer, measured_tilt
from hrp2_sim_bridge.control.stance_reference import ReferenceStanceModel
from hrp2_sim_bridge.settings import TICK
from humanoid_motion.driver_interface import ImuSample, TickSample
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.spline import JointReference
from humanoid_motion.whole_body import solve
from hypothesis import given
from hypothesis import strategies as st

TURNS = st.floats(-0.25, 0.25)
COM = np.array([0.012, 0.01])


def at_rest(position):
    return JointReference(np.array(position), np.zeros(30), np.zeros(30))


def resting(position):
    """Return a reference at rest."""
    return lambda _time: at_rest(position)


def sample(robot, time=0.0, turn=(0.0, 0.0, 0.0, 1.0), rate=(0.0, 0.0, 0.0), load=(285.0, 285.0)):
    """Return measurements in half-sitting with a turned IMU and given loads of the feet."""
    wrenches = [np.array([0.0, 0.0, force, 0.0, -0.015 * force, 0.0]) for force in load]
    imu = ImuSample(np.array(turn), np.array(rate), np.array([0.0, 0.0, GRAVITY]))
    return TickSample(
        time, robot.half_sitting, np.zeros(30), np.zeros(30), *wrenches, imu, (0,) * 5)


def offset_at(stabilizer, time):
    """Return the correction (30,) at a time."""
    return stabilizer.offsets(np.array([time]))[0]


def about(axis, angle):
    """Return the quaternion x, y, z, w of a turn about an axis of the world."""
    return np.append(np.sin(angle / 2.0) * np.eye(3)[axis], np.cos(angle / 2.0))


@pytest.mark.parametrize("axis", [0, 1])
def test_tilt_is_what_the_imu_turned_and_not_what_the_trunk_was_told(robot, axis) -> None:
    """A tilt is measured about its own axis, and a bent chest is not a tilt."""
    stance = ReferenceStanceModel(robot).at(at_rest(robot.posture({"CHEST_JOINT1": 0.2})))
    bent = sample(robot, turn=about(1, 0.2))
    np.testing.assert_allclose(measured_tilt(bent, stance)[0], 0.0, atol=1e-9)
    upright = ReferenceStanceModel(robot).at(at_rest(robot.half_sitting))
    tilt, rate = measured_tilt(sample(robot, turn=about(axis, 0.01), rate=np.eye(3)[axis]), upright)
    np.testing.assert_allclose(tilt, 0.01 * np.eye(2)[axis], atol=1e-6)
    np.testing.assert_allclose(rate, np.eye(2)[axis], atol=1e-9)


@pytest.mark.nightly("two seconds of simulated time")
def test_zmp_of_the_reference_is_that_of_the_simulated_robot(make_world, sway, moving) -> None:
    """On rigid soles the ZMP of the reference is that of the simulation to millimeters."""
    world = make_world(sole="rigid", friction=0.4)  # with more friction soles chatter
    path = np.array([sway(y) for y in (0.0, 0.03, -0.03, 0.0)])
    world.follow(moving(np.array([0.1, 0.8, 1.6, 2.3]), path), 0.0)
    model, said, felt = ReferenceStanceModel(world.robot_config), [], []
    for _ in range(480):
        stance = model.at(world.driver.sample(world.time + 0.5 * TICK))
        base = world.engine.base_states(np.array([world.engine.read_base()]))
        said.append(stance.zmp + base[0, :2])
        now = world.step()
        force = np.array([now.left_wrench[2], now.right_wrench[2]])
        place = world.links.position[:2]
        torque = now.left_wrench[3:5] + now.right_wrench[3:5]
        felt.append((force @ place[:, :2] + np.array([-torque[1], torque[0]])) / force.sum())
    error = np.abs(np.array(said) - felt)
    assert np.ptp(np.array(said)[:, 1]) > 0.08
    assert np.median(error) < 1e-3
    assert np.percentile(error, 95.0) < 1e-2  # joints that give swing


def test_corrections_are_bounded_and_respect_the_joints_limits(robot) -> None:
    """In any lean the corrections are bounded and the legs stay within their limits."""
    rest = robot.half_sitting
    narrow = replace(robot, lower=rest - 0.02, upper=rest + 0.02)
    stabilizer, farthest = Stabilizer(narrow), 0.0
    for tick in range(400):
        leaning = sample(robot, tick * TICK, about(0, 0.5), load=(500.0, 0.0))
        stabilizer.update(leaning, resting(rest))
        farthest = max(farthest, np.abs(offset_at(stabilizer, (tick + 1) * TICK)).max())
    assert farthest == pytest.approx(0.02)


def test_corrections_are_continuous_in_time(robot) -> None:
    """The corrections of a tick begin at the end of the previous ones and are linear in time."""
    stabilizer, reference = Stabilizer(robot), resting(robot.half_sitting)
    for tick in range(20):
        begin = tick * TICK
        ended = offset_at(stabilizer, begin)
        stabilizer.update(sample(robot, begin, about(0, 0.002 * tick)), reference)
        np.testing.assert_allclose(offset_at(stabilizer, begin), ended, atol=1e-12)
        middle = 0.5 * (offset_at(stabilizer, begin) + offset_at(stabilizer, begin + TICK))
        np.testing.assert_allclose(offset_at(stabilizer, begin + 0.5 * TICK), middle, atol=1e-12)


def test_a_load_of_the_hands_begins_and_ends_to_count_without_a_jump(robot) -> None:
    """A load that was there before changes no correction, and one that grows changes them."""
    reference, load = resting(robot.half_sitting), np.array([-15.0, 8.0, 0.0, 2.0, 3.0, 0.0])
    plain, told = Stabilizer(robot), Stabilizer(robot)
    for tick, hands in enumerate([None] * 40 + [load] * 40 + [None] * 40 + [load, 1.5 * load] * 2):
        begin = tick * TICK
        plain.update(sample(robot, begin), reference)
        told.update(sample(robot, begin), reference, hands)
        change = np.abs(offset_at(told, begin + TICK) - offset_at(plain, begin + TICK)).max()
        assert (change < 1e-9) == (tick <= 120)
    assert change > 1e-4


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
