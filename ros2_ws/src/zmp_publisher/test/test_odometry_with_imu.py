"""Leg odometry with an IMU, against footholds that are known."""

import dataclasses
import math

import numpy as np
import pinocchio as pin
import pytest
from footholds import MODEL, ROBOT, ExactImu, assert_true, base_at, legs, walk
from humanoid_motion.kinematics import planar_pose, yaw_of
from humanoid_motion.robot_model import RobotModel
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.soles import HEADING_TIME

RIGID = RobotModel(dataclasses.replace(ROBOT, sole_rubber=None))
BOTH = {"left": 285.0, "right": 284.0}
APART = {"left": planar_pose(0.0, 0.095, 0.0), "right": planar_pose(0.0, -0.095, 0.0)}


def _odometry(robot=RIGID, **settings):
    return FootOdometry(robot, loaded_force=28.0, **settings)


def _stand(odometry, imu, base, soles, loads=BOTH, times=1):
    positions = legs(base, soles)
    for _ in range(times):
        pose = odometry.update(positions, loads, imu.read(positions, base), imu.time)
    return pose


@pytest.mark.parametrize(("share", "rpy"), [
    (0.5, (0.0, 0.0, 0.0)), (1.0, (np.pi, 0.0, np.pi / 2)), (1.0, (0.0, np.pi / 2, 0.0))])
def test_stepping_returns_the_true_footholds_also_with_an_imu_that_comes_and_goes(share, rpy):
    """Over 12 steps with turns, whatever the IMU's own heading, and also if it lies on its side."""
    rng, robot = np.random.default_rng(0), RobotModel(RIGID.config)
    frame = robot.model.frames[robot.model.getFrameId(ROBOT.imu_frame)]
    frame.placement.rotation = pin.rpy.rpyToMatrix(*rpy)
    odometry, imu = _odometry(robot), ExactImu(robot=robot)
    used = []
    for positions, loads, base, soles in walk(12, np.random.default_rng(11)):
        reading = imu.read(positions, base)
        # A sole enters while both bear load, so the method changes only there.
        if min(loads.values()) > 200.0:
            there = rng.random() < share
        pose = odometry.update(positions, loads, reading if there else None, imu.time)
        assert_true(pose, base, soles)
        used.append(odometry.uses_imu)
    assert set(used) == ({True, False} if share < 1.0 else {True})


def test_a_tilted_sole_does_not_tilt_the_robot():
    """Soles that lean on their rubber by 1 deg leave the base where it is, in place and tilt."""
    odometry, imu = _odometry(), ExactImu()
    upright = base_at(0.0, 0.0)
    _stand(odometry, imu, upright, APART)
    tilted = {side: sole.copy() for side, sole in APART.items()}
    for sole in tilted.values():
        sole[:3, :3] = pin.rpy.rpyToMatrix(0.017, -0.017, 0.0)
    pose = _stand(odometry, imu, upright, tilted)
    assert_true(pose, upright, tilted)


def test_soles_sink_into_their_rubber_by_what_they_bear():
    """The soles are below the floor by load over stiffness, weighted by their loads."""
    odometry, imu = _odometry(MODEL), ExactImu()
    stiffness = ROBOT.sole_rubber.stiffness
    sunk = {side: sole.copy() for side, sole in APART.items()}
    for side, sole in sunk.items():
        sole[2, 3] = -BOTH[side] / stiffness
    base = base_at(0.0, 0.0, 0.61)
    assert_true(_stand(odometry, imu, base, sunk, times=2), base, sunk)


def test_a_foot_enters_without_a_jump():
    """A foot that lands 5 mm from where the joints see it moves the robot by less than 1 mm a tick.

    It ends where it landed: the held foot and the foot that lands share what they disagree on.
    """
    odometry, imu = _odometry(), ExactImu(period=0.005)
    base = base_at(0.0, 0.0)
    _stand(odometry, imu, base, APART, {"left": 569.0, "right": 0.0}, times=10)
    places = []
    for share in np.linspace(0.0, 0.5, 21):
        # The legs give as the load passes over: the feet seem to come apart.
        apart = {side: sole.copy() for side, sole in APART.items()}
        apart["right"][1, 3] -= 0.01 * share
        loads = {"left": 569.0 * (1.0 - share), "right": 569.0 * share}
        places.append(_stand(odometry, imu, base, apart, loads).base[:2, 3])
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() < 0.001
    assert np.linalg.norm(places[-1] - base[:2, 3]) < 0.0025


def test_standing_does_not_drift():
    """A gyro with a bias of 1 mrad/s turns a robot that stands by its bias times the time constant.

    The load sways from foot to foot for 20 s; the place does not move.
    """
    bias = 1e-3
    odometry, imu = _odometry(), ExactImu(period=0.005, bias=bias)
    base = base_at(0.0, 0.0)
    positions = legs(base, APART)
    for tick in range(4000):
        share = 0.5 + 0.19 * math.sin(0.02 * tick)
        loads = {"left": 569.0 * share, "right": 569.0 * (1.0 - share)}
        pose = odometry.update(positions, loads, imu.read(positions, base), imu.time)
        assert abs(yaw_of(pose.base)) < 1.2 * bias * HEADING_TIME
    assert np.linalg.norm(pose.base[:2, 3] - base[:2, 3]) < 1e-4


def test_heading_of_the_gyro_while_the_soles_mislead():
    """Hips that seem to turn for 0.1 s, and turn back, leave the heading within a fifth of that."""
    odometry, imu = _odometry(), ExactImu(period=0.005)
    base = base_at(0.0, 0.0)
    _stand(odometry, imu, base, APART, times=10)
    twisted = {side: sole @ planar_pose(0.0, 0.0, 0.01) for side, sole in APART.items()}
    yaws = [yaw_of(_stand(odometry, imu, base, twisted).base) for _ in range(20)]
    assert 0.0 < np.max(np.abs(yaws)) < 0.2 * 0.01


def test_after_a_gap_the_heading_is_that_of_the_soles():
    """The gyro tells nothing of what happened between two readings that are far apart."""
    odometry, imu = _odometry(), ExactImu()
    _stand(odometry, imu, base_at(0.0, 0.0), APART)
    turned = base_at(0.0, 0.0, tilt=(0.0, 0.0, 0.1))
    imu.time += 0.2
    assert_true(_stand(odometry, imu, turned, APART), turned, APART)


def test_a_fall_in_which_both_feet_lose_the_floor_keeps_the_last_footholds():
    """In the air the poses go on from the soles as they last stood."""
    odometry, imu = _odometry(), ExactImu()
    _stand(odometry, imu, base_at(0.0, 0.0), APART)
    high = base_at(0.01, 0.0, 0.60, (0.1, 0.2, 0.0))
    assert_true(_stand(odometry, imu, high, APART, {"left": 3.0, "right": 0.0}), high, APART)


@pytest.mark.parametrize("wrong", [
    lambda rate: np.degrees(rate), lambda rate: -rate, lambda rate: 0.0 * rate,
    lambda rate: rate[[2, 1, 0]]], ids=["deg/s", "reversed", "zeros", "turned axes"])
def test_a_gyro_that_contradicts_the_soles_is_named_and_the_soles_win(wrong):
    """A robot turns by 40 deg on one sole; the heading is that of the sole within 3 deg."""
    odometry, imu = _odometry(), ExactImu()
    alone = {"left": 569.0, "right": 0.0}
    for turn in np.linspace(0.0, math.radians(40.0), 80):
        base = base_at(0.0, 0.095, tilt=(0.0, 0.0, turn))
        soles = {"left": APART["left"], "right": base @ planar_pose(0.0, -0.19, 0.0)}
        soles["right"][2, 3] = 0.03
        positions = legs(base, soles)
        reading = imu.read(positions, base)
        reading = dataclasses.replace(reading, angular_velocity=wrong(reading.angular_velocity))
        pose = odometry.update(positions, alone, reading, imu.time)
        assert abs(yaw_of(pose.base) - turn) < math.radians(3.5)
    assert "gyro" in odometry.doubt
    assert abs(yaw_of(pose.base) - turn) < 1e-6
