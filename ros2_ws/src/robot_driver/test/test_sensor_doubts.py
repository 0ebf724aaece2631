"""Sensors that contradict what is known of a robot at rest are doubted by name."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample, Measured
from robot_driver.sensor_doubts import doubts

Change = Callable[[Measured], Measured]


def standing(robot: RobotModel, change: Change = lambda sample: sample) -> list[Measured]:
    """Samples of 0.25 s with the noise of good sensors."""
    rng, weight = np.random.default_rng(1), robot.config.mass * GRAVITY
    made = []
    for tick in range(50):
        turn = np.array([*(1e-3 * rng.normal(size=2)), 0.4, 0.9])
        imu = ImuSample(turn / np.linalg.norm(turn), 5e-3 * rng.normal(size=3),
                        np.array([0.0, 0.0, GRAVITY]) + 0.05 * rng.normal(size=3))
        foot = np.array([0.0, 0.0, 0.5 * weight + rng.normal(), 0.0, 0.0, 0.0])
        noise = rng.normal(size=len(robot.joint_names))
        made.append(change(Measured(robot.config.half_sitting + 1e-4 * noise, 0.02 * noise, imu,
                                    foot, foot, 0.005 * tick)))
    return made


def imu(**parts: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Change parts of the IMU's reading."""
    return lambda sample: replace(sample, imu=replace(
        sample.imu, **{name: part(getattr(sample.imu, name)) for name, part in parts.items()}))


def feet(factor: float) -> Change:
    """Scale both wrenches."""
    return lambda sample: replace(sample, left_wrench=factor * sample.left_wrench,
                                  right_wrench=factor * sample.right_wrench)


def identity(_: np.ndarray) -> np.ndarray:
    return np.array([0.0, 0.0, 0.0, 1.0])


WRONG: dict[str, tuple[Change, str, bool]] = {
    "wrenches upside down": (feet(-1.0), "reversed", True),
    "wrenches in kgf": (feet(1.0 / GRAVITY), "kgf", True),
    "wrenches ten times too large": (feet(10.0), "weighs", False),
    "wrenches that are not measured": (feet(0.0), "0 N in sum", True),
    "one foot that is not measured": (
        lambda sample: replace(sample, left_wrench=0.4 * sample.left_wrench,
                               right_wrench=0.0 * sample.right_wrench), "weighs", True),
    "an IMU that is mounted upside down": (
        imu(orientation=lambda q: np.array([q[3], -q[2], q[1], -q[0]]),
            specific_force=lambda f: -f), "legs", True),
    "joints whose zeros are off": (
        lambda sample: replace(sample, position=sample.position + 0.1), "legs", True),
    "orientation in NED": (
        imu(orientation=lambda q: np.array([q[3], -q[2], q[1], -q[0]])), "NED", True),
    "orientation that leans by 15 deg": (
        imu(orientation=lambda q: np.array([0.13, 0.0, 0.0, 0.99])), "disagree", True),
    "orientation that is never filled in": (imu(orientation=identity), "no orientation", True),
    "accelerometer in g": (imu(specific_force=lambda f: f / GRAVITY), "in g", False),
    "accelerometer without gravity": (
        imu(specific_force=lambda f: f - [0.0, 0.0, GRAVITY]), "taken out", False),
    "accelerometer that points down": (imu(specific_force=lambda f: -f), "disagree", True),
    "accelerometer in milli-g": (imu(specific_force=lambda f: 1e3 * f / GRAVITY), "m/s^2", False),
    "gyro with an offset in deg/s": (imu(angular_velocity=lambda w: w + 2.0), "gyro", False),
    "joint speeds that are positions": (
        lambda sample: replace(sample, velocity=sample.position), "according to its speeds", True),
    "joint speeds with an offset": (
        lambda sample: replace(sample, velocity=sample.velocity + 0.5), "rad/s", True),
}


@pytest.mark.parametrize(("change", "word", "grave"), WRONG.values(), ids=WRONG)
def test_a_wrong_sensor_is_doubted_by_name(
        robot: RobotModel, change: Change, word: str, grave: bool) -> None:
    """No motion begins where it would rest on what is wrong."""
    found = doubts(robot, standing(robot, change))
    assert [each.grave for each in found] == [grave]
    assert word in found[0].text


@pytest.mark.parametrize(("unit", "doubted"), [(1.0, False), (np.degrees(1.0), True), (-4.0, True)])
def test_a_gyro_in_another_unit_is_doubted_as_soon_as_the_robot_turns(
        robot: RobotModel, unit: float, doubted: bool) -> None:
    """By 0.4 rad/s about the vertical, as in a walk."""
    samples = []
    for sample in standing(robot):
        turn = np.array([0.0, 0.0, np.sin(0.2 * sample.time), np.cos(0.2 * sample.time)])
        samples.append(replace(
            sample, position=sample.position + 0.1 * sample.time, velocity=sample.velocity + 0.1,
            imu=replace(sample.imu, orientation=turn,
                        angular_velocity=unit * np.array([0.0, 0.0, 0.4]))))
    assert [each.topic for each in doubts(robot, samples)] == ["imu"] * doubted


@pytest.mark.parametrize(("unit", "doubted"), [
    (1.0, False), (np.nan, False), (0.0, True), (np.degrees(1.0), True), (-1.0, True)])
def test_joint_speeds_that_are_zeros_or_in_another_unit_are_doubted_as_soon_as_a_joint_moves(
        robot: RobotModel, unit: float, doubted: bool) -> None:
    """By 0.6 rad/s; NaN stands for a speed that is not measured."""
    samples = [replace(sample, position=sample.position + 0.6 * sample.time,
                       velocity=unit * (sample.velocity + 0.6)) for sample in standing(robot)]
    assert [each.topic for each in doubts(robot, samples)] == ["joint_states"] * doubted


def test_good_sensors_raise_no_doubt(robot: RobotModel) -> None:
    """Nor do those of a robot that moves, of which less is known, nor an IMU without extras."""
    assert doubts(robot, standing(robot)) == []
    assert doubts(robot, standing(robot, imu(specific_force=np.zeros_like))) == []
    assert doubts(robot, []) == []
    moving = [replace(sample, position=sample.position + sample.time,
                      velocity=sample.velocity + 1.0, left_wrench=0.0 * each)
              for sample in standing(robot) for each in [sample.left_wrench]]
    assert doubts(robot, moving) == []
