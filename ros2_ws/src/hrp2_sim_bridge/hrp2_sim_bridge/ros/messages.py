"""Conversions between the simulation's dataclasses and the messages of the driver's topics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from door_impact_common.arrays import Array
from door_impact_common.stamps import seconds
from geometry_msgs.msg import WrenchStamped
from humanoid_motion.driver_interface import ImuSample, TickSample, TrajectoryArrays
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory

from hrp2_sim_bridge.sensors.imu import ImuVariances


def trajectory_arrays(message: JointTrajectory) -> TrajectoryArrays:
    """Return the content of a trajectory message, unchecked."""
    points = message.points
    return TrajectoryArrays(
        joint_names=list(message.joint_names),
        times=[seconds(point.time_from_start) for point in points],
        positions=[list(point.positions) for point in points],
        velocities=[list(point.velocities) for point in points],
        accelerations=[list(point.accelerations) for point in points],
    )


def joint_state(stamp: Time, names: Sequence[str], sample: TickSample) -> JointState:
    """Return the message of joint positions [rad], velocities [rad/s] and torques [N m]."""
    message = JointState()
    message.header.stamp = stamp
    message.name = list(names)
    message.position = sample.position.tolist()
    message.velocity = sample.velocity.tolist()
    message.effort = sample.effort.tolist()
    return message


def wrench(stamp: Time, frame: str, values: Array) -> WrenchStamped:
    """Return the message of a force [N] and a torque [N m], (6,), in a frame."""
    message = WrenchStamped()
    message.header.stamp = stamp
    message.header.frame_id = frame
    force, torque = message.wrench.force, message.wrench.torque
    force.x, force.y, force.z, torque.x, torque.y, torque.z = values.tolist()
    return message


def imu(stamp: Time, frame: str, sample: ImuSample, variances: ImuVariances) -> Imu:
    """Return the message of an IMU's reading, with the variances on the covariances' diagonals."""
    message = Imu()
    message.header.stamp = stamp
    message.header.frame_id = frame
    turn, rate, force = (
        message.orientation, message.angular_velocity, message.linear_acceleration,
    )
    turn.x, turn.y, turn.z, turn.w = sample.orientation.tolist()
    rate.x, rate.y, rate.z = sample.angular_velocity.tolist()
    force.x, force.y, force.z = sample.specific_force.tolist()
    message.orientation_covariance[::4] = variances.orientation
    message.angular_velocity_covariance[::4] = variances.angular_velocity
    message.linear_acceleration_covariance[::4] = variances.specific_force
    return message


def diagnostics(
    stamp: Time, robot: str, level: bytes, text: str, values: Mapping[str, object]
) -> DiagnosticArray:
    """Return the message of the driver's state.

    Args:
        stamp: Time of the state.
        robot: Name of the robot.
        level: Level of `DiagnosticStatus`.
        text: State in words.
        values: Further values by their names.
    """
    status = DiagnosticStatus()
    status.name = "hrp2_sim_bridge: driver"
    status.hardware_id = robot
    status.level = level
    status.message = text
    status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    message = DiagnosticArray()
    message.header.stamp = stamp
    message.status = [status]
    return message
