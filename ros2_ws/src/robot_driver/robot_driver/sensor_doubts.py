"""Doubts about a robot's sensors: what they say against each other and what is known of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

import numpy as np
import pinocchio as pin
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import Doubt, Measured

from robot_driver.names import IMU, JOINTS, WRENCHES

_REST = 0.02  # largest change of a joint, and turn of the IMU, of a robot at rest [rad]
_LEAST_LOAD, _MOST_LOAD = 0.7, 1.3  # load of both soles of a robot at rest, as share of the weight
_SHIFT = 0.1  # largest change of a sole's load of a robot at rest, as share of the weight
_BEGIN = 1.0  # time up to which a simulation has just begun [s]
_FORCE = 1.0  # largest error of the specific force of a trunk at rest [m/s^2]
_TURN = math.radians(10.0)  # largest angle between the verticals of accelerometer and orientation
_DRIFT, _SCALE = 0.05, 0.2  # largest error of integrated speeds: angle [rad], and share of the way
_LEAN = math.radians(6.0)  # largest angle between the verticals of IMU and legs


def doubts(robot: RobotModel, samples: Sequence[Measured]) -> list[Doubt]:
    """Find what sensors cannot have measured, of a robot at rest on its soles most of all.

    Args:
        robot: The robot.
        samples: Successive complete samples, some 0.2 s of them.
    """
    if len(samples) < 2:
        return []
    position = np.array([each.position for each in samples])
    if np.ptp(position, axis=0).max() > _REST:
        return [*_speeds(robot, samples), *_gyro(samples)]
    load = list(_load(robot, samples))
    upright = [] if load else list(_legs(robot, samples[-1]))
    return [*_speeds(robot, samples), *load, *_gyro(samples), *(list(_imu(samples)) or upright)]


def stood_still(before: Measured, after: Measured, weight: float) -> bool:
    """Whether joints, loads of the soles and IMU say that a robot has not moved between samples.

    Args:
        before: A sample.
        after: The next one; at a time near 0 a simulation begins, whatever the robot did before.
        weight: The robot's weight [N].
    """
    shift = [getattr(after, foot)[2] - getattr(before, foot)[2]
             for foot in ("left_wrench", "right_wrench")]
    turn = before.imu.rotation.T @ after.imu.rotation
    return bool(
        after.time > min(before.time, _BEGIN)
        and np.abs(after.position - before.position).max() <= _REST
        and np.abs(shift).max() <= _SHIFT * weight
        and np.linalg.norm(pin.log3(turn)) <= _REST)


def grave(found: Iterable[Doubt]) -> tuple[str, float] | None:
    """Return the first doubt with which no motion may begin, as a sentence and a value, if any."""
    return next(((f"{doubt.topic}: {doubt.text}", doubt.value) for doubt in found
                 if doubt.grave), None)


def _speeds(robot: RobotModel, samples: Sequence[Measured]) -> Iterator[Doubt]:
    """Joints move by what their speeds say: other units, other signals, and zeros do not."""
    times = np.array([each.time for each in samples])
    speeds = np.array([each.velocity for each in samples])
    moved = samples[-1].position - samples[0].position
    by_speed = np.diff(times) @ (0.5 * (speeds[1:] + speeds[:-1]))
    over = np.abs(moved - by_speed) - (_DRIFT + _SCALE * np.abs(moved))
    worst = int(np.argmax(over))
    if over[worst] > 0.0:  # NaN, an unknown speed, is no contradiction
        yield Doubt(JOINTS, f"in {times[-1] - times[0]:.2f} s {robot.joint_names[worst]} has moved "
                    f"by {moved[worst]:.3f} rad, but by {by_speed[worst]:.3f} rad according to its "
                    f"speeds, which may differ by {_DRIFT + _SCALE * abs(moved[worst]):.3f} rad: "
                    "are the speeds in rad/s?", float(by_speed[worst]), True)


def _load(robot: RobotModel, samples: Sequence[Measured]) -> Iterator[Doubt]:
    """Both soles together bear the weight, and the floor pushes them upward."""
    weight = robot.config.mass * GRAVITY
    load = float(np.mean([each.left_wrench[2] + each.right_wrench[2] for each in samples]))
    if _LEAST_LOAD * weight <= load <= _MOST_LOAD * weight:
        return
    cause = ""
    if -_MOST_LOAD * weight <= load <= -_LEAST_LOAD * weight:
        cause = ": the floor's force on a sole points upward, so is force.z reversed?"
    elif _LEAST_LOAD * weight <= load * GRAVITY <= _MOST_LOAD * weight:
        cause = ": is the force in kgf?"
    yield Doubt(
        " and ".join(WRENCHES.values()),
        f"force.z of both feet is {load:.0f} N in sum, but the robot weighs {weight:.0f} N "
        f"({_LEAST_LOAD * weight:.0f} to {_MOST_LOAD * weight:.0f} N are expected at rest){cause}",
        load, load < _LEAST_LOAD * weight)


def _gyro(samples: Sequence[Measured]) -> Iterator[Doubt]:
    """The gyro turns as the orientation does."""
    first, last = samples[0].imu.rotation, samples[-1].imu.rotation
    rates = np.array([each.imu.angular_velocity for each in samples])
    times = np.array([each.time for each in samples])
    by_gyro = np.diff(times) @ (0.5 * (rates[1:] + rates[:-1]))
    by_orientation = pin.log3(first.T @ last)
    off = float(np.linalg.norm(by_gyro - by_orientation))
    allowed = _DRIFT + _SCALE * float(np.linalg.norm(by_orientation))
    if off > allowed:
        yield Doubt(
            IMU, f"in {times[-1] - times[0]:.2f} s the orientation has turned by "
            f"{np.linalg.norm(by_orientation):.3f} rad, the gyro by {np.linalg.norm(by_gyro):.3f} "
            f"rad, which differ by {off:.3f} rad, at most {allowed:.3f} rad are expected: is the "
            "gyro in rad/s, and are its axes those of the orientation?", off, False)


def _legs(robot: RobotModel, sample: Measured) -> Iterator[Doubt]:
    """Soles that lie on the floor show the same vertical as the IMU."""
    frame = robot.config.imu_frame
    if frame is None or not sample.imu.orientation[:3].any():
        return
    feet = [robot.feet[side].frame for side in SIDES]
    *soles, imu = robot.poses_in_base(sample.position, [*feet, frame])
    legs = np.mean([pose[:3, 2] for pose in soles], axis=0)
    vertical = imu[:3, :3] @ sample.imu.rotation[2]
    off = math.acos(max(-1.0, min(1.0, float(legs @ vertical / np.linalg.norm(legs)))))
    if off > _LEAN:
        yield Doubt(
            IMU, f"the orientation and the legs disagree about the vertical by "
            f"{math.degrees(off):.1f} deg, at most {math.degrees(_LEAN):g} deg are allowed: is the "
            f"IMU mounted as {frame}, and are the joints' zeros right?", off, True)


def _imu(samples: Sequence[Measured]) -> Iterator[Doubt]:
    """Accelerometer and orientation of a trunk at rest fit each other and gravity."""
    doubt: Callable[..., Doubt] = partial(Doubt, IMU)
    turns = np.array([each.imu.orientation for each in samples])
    rates = np.array([each.imu.angular_velocity for each in samples])
    if not turns[:, :3].any() and np.ptp(rates, axis=0).any():
        yield doubt("the orientation is always exactly the identity, while the gyro changes: this "
                    "IMU has no orientation, and must say so by orientation_covariance[0] = -1",
                    0.0, True)
    force = np.mean([each.imu.specific_force for each in samples], axis=0)
    size = float(np.linalg.norm(force))
    if not force.any():
        return  # there is no accelerometer
    if abs(size - GRAVITY) > _FORCE:
        cause = ": is it in g?" if abs(size * GRAVITY - GRAVITY) < _FORCE else (
            ": is gravity taken out of it?" if size < _FORCE else "")
        yield doubt(f"the specific force of a robot at rest is {size:.2f} m/s^2, expected are "
                    f"{GRAVITY:.2f} +- {_FORCE:g}{cause}", size, False)
        return
    vertical = samples[-1].imu.rotation @ (force / size)
    off = math.acos(max(-1.0, min(1.0, float(vertical[2]))))
    if off > _TURN:
        cause = " (is the orientation in NED instead of ENU, or the IMU mounted upside down?)" \
            if off > math.radians(150.0) else ""
        yield doubt(f"accelerometer and orientation disagree about the vertical by "
                    f"{math.degrees(off):.1f} deg, at most {math.degrees(_TURN):g} deg are "
                    f"allowed{cause}", off, True)
