"""Conversions of the messages that every driver sends and receives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from door_impact_common.arrays import Array
from door_impact_common.stamps import NANOSECONDS, duration_of, stamp_of
from geometry_msgs.msg import Vector3, Wrench
from humanoid_motion.driver_interface import Command
from humanoid_motion.knots import Knots
from humanoid_motion.samples import ImuSample
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from robot_driver.intake import Intake

_UNIT = 0.1  # largest difference between the length of a unit quaternion and 1


def trajectory_message(knots: Knots, names: Sequence[str]) -> JointTrajectory:
    """Convert points to a JointTrajectory without a stamp.

    Args:
        knots: The points; their times become `time_from_start`.
        names: Joint names in the order of their columns.
    """
    message = JointTrajectory(joint_names=list(names))
    for i, time in enumerate(knots.time):
        message.points.append(
            JointTrajectoryPoint(
                positions=knots.position[i].tolist(),
                velocities=knots.velocity[i].tolist(),
                accelerations=knots.acceleration[i].tolist(),
                time_from_start=duration_of(round(float(time) * NANOSECONDS)),
            )
        )
    return message


def command_message(command: Command, names: Sequence[str]) -> JointTrajectory:
    """Convert a command to the JointTrajectory that the driver takes; a stop has no points.

    Args:
        command: The command.
        names: Joint names in the order of the points' columns.
    """
    if command.knots is None:
        return JointTrajectory()
    message = trajectory_message(command.knots, names)
    message.header.stamp = stamp_of(round(command.stamp * NANOSECONDS))
    return message


def joint_arrays(message: Any, names: Sequence[str]) -> tuple[Array, Array] | None:
    """Read joint positions and joint speeds from a JointState.

    Args:
        message: The JointState; it may have further joints and any order.
        names: Joint names in the order of the result.

    Returns:
        Positions, (J,) [rad], and speeds, (J,) [rad/s], NaN where the message has none; None if a
        joint is missing or its position is no finite number.
    """
    given = list(message.name)
    position = np.array(message.position)
    velocity = np.array(message.velocity or np.full(len(given), np.nan))
    if not (len(given) == len(position) == len(velocity) and set(names) <= set(given)):
        return None
    if given != list(names):
        order = [given.index(name) for name in names]
        position, velocity = position[order], velocity[order]
    return (position, velocity) if np.isfinite(position).all() else None


def lacking(message: Any, names: Sequence[str]) -> str:
    """Say what a JointState lacks that `joint_arrays` cannot read."""
    given, count = list(message.name), len(message.name)
    if missing := [name for name in names if name not in given]:
        return f"it has no {missing[0]}" + (
            f" and {len(missing) - 1} more" if len(missing) > 1 else "")
    for what, values in (("positions", message.position), ("speeds", message.velocity)):
        if len(values) != count:
            return f"it has {len(values)} {what} for {count} names"
    return next((f"the position of {name} is {value}" for name in names
                 if not math.isfinite(value := message.position[given.index(name)])), "")


def imu_sample(message: Any) -> ImuSample | None:
    """Convert an Imu to a reading with a unit quaternion.

    Returns:
        The reading, with zeros for the specific force where there is no accelerometer; None if
        orientation or angular velocity is missing (by REP 145 the first element of its covariance
        is -1), not finite, or no rotation. A message as constructed, an exact identity without
        gravity, has no orientation.
    """
    turn, rate = message.orientation, message.angular_velocity
    orientation = np.array([turn.x, turn.y, turn.z, turn.w])
    velocity = np.array([rate.x, rate.y, rate.z])
    force = np.zeros(3)
    if message.linear_acceleration_covariance[0] != -1.0:
        each = message.linear_acceleration
        force = np.array([each.x, each.y, each.z])
    length = float(np.linalg.norm(orientation))
    known = (message.orientation_covariance[0] != -1.0
             and message.angular_velocity_covariance[0] != -1.0
             and bool(orientation[:3].any() or force.any()))
    if not (known and abs(length - 1.0) <= _UNIT and np.isfinite([*velocity, *force]).all()):
        return None
    return ImuSample(orientation / length, velocity, force)


def wrench_row(wrench: Any) -> Array:
    """Convert a Wrench to a row of force and torque, (6,) [N, N m]."""
    force, torque = wrench.force, wrench.torque
    return np.array([force.x, force.y, force.z, torque.x, torque.y, torque.z])


def wrench_of(row: Sequence[float]) -> Wrench:
    """Convert a row of force and torque, (6,) [N, N m], to a Wrench."""
    return Wrench(force=Vector3(x=row[0], y=row[1], z=row[2]),
                  torque=Vector3(x=row[3], y=row[4], z=row[5]))


def diagnostics(
    node: str, intake: Intake, crowded: Mapping[str, Sequence[str]], stamp: Any
) -> DiagnosticArray:
    """Make the message for /diagnostics.

    Args:
        node: Full name of the node whose inputs they are, without the first slash.
        intake: The checks of the messages, with what they have noticed.
        crowded: Names of the publishers of each topic that has more than one.
        stamp: Present time, a builtin_interfaces/Time.
    """
    noticed = intake.noticed()
    noticed.update({f"publishers of {topic}": ", ".join(names)
                    for topic, names in sorted(crowded.items())})
    status = DiagnosticStatus(
        name=f"{node}: inputs", hardware_id=node,
        level=DiagnosticStatus.WARN if noticed else DiagnosticStatus.OK,
        message="; ".join(noticed) or "every message was in time and made sense",
        values=[KeyValue(key=key, value=value) for key, value in noticed.items()])
    array = DiagnosticArray(status=[status])
    array.header.stamp = stamp
    return array
