"""Between the simulator's dataclasses and the messages of the driver's topics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from door_impact_common.arrays import Array
from door_impact_msgs.msg import EncoderSamples
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory

from hrp2_sim_bridge.control.trajectory import TrajectoryArrays
from hrp2_sim_bridge.sensors.imu import ImuSample, ImuVariances
from hrp2_sim_bridge.sensors.sensors import COUNTS_PER_TURN, TickSample

DOOR_JOINT = "door_hinge"
_NANO = 1_000_000_000


def stamp_of(nanoseconds: int) -> Time:
    """Simulated time as a stamp."""
    return Time(sec=nanoseconds // _NANO, nanosec=nanoseconds % _NANO)


def seconds(stamp: Any) -> float:
    """A Time or Duration message in seconds."""
    return float(stamp.sec) + float(stamp.nanosec) * 1e-9


def trajectory_arrays(message: JointTrajectory) -> TrajectoryArrays:
    """The content of a trajectory, unchecked."""
    points = message.points
    return TrajectoryArrays(
        joint_names=list(message.joint_names),
        times=[seconds(point.time_from_start) for point in points],
        positions=[list(point.positions) for point in points],
        velocities=[list(point.velocities) for point in points],
        accelerations=[list(point.accelerations) for point in points],
    )


def joint_state(stamp: Time, names: Sequence[str], sample: TickSample) -> JointState:
    """Joint positions, velocities and torques."""
    message = JointState()
    message.header.stamp = stamp
    message.name = list(names)
    message.position = sample.position.tolist()
    message.velocity = sample.velocity.tolist()
    message.effort = sample.effort.tolist()
    return message


def wrench(stamp: Time, frame: str, values: Array) -> WrenchStamped:
    """Force [N] and torque [N m] (6,) in a frame."""
    message = WrenchStamped()
    message.header.stamp = stamp
    message.header.frame_id = frame
    force, torque = message.wrench.force, message.wrench.torque
    force.x, force.y, force.z, torque.x, torque.y, torque.z = values.tolist()
    return message


def imu(stamp: Time, frame: str, sample: ImuSample, variances: ImuVariances) -> Imu:
    """Orientation, angular velocity and specific force with the diagonals of their covariances."""
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


class EncoderBatcher:
    """Collects the counter's samples and hands them out in batches.

    Args:
        period: between two samples [s].
        size: samples a batch.
    """

    def __init__(self, period: float, size: int) -> None:
        self._period = period
        self._size = size
        self._counts: list[int] = []
        self._index = 0
        self._gap = False

    def restart(self) -> None:
        """Forget what was collected; the next batch tells of the gap."""
        self._index += len(self._counts)
        self._counts.clear()
        self._gap = True

    def add(self, counts: Sequence[int], nanoseconds: int) -> EncoderSamples | None:
        """Add samples, the last one taken at a time [ns]; returns a batch when it is full."""
        self._counts.extend(counts)
        if len(self._counts) < self._size:
            return None
        message = EncoderSamples()
        back = round((len(self._counts) - 1) * self._period * _NANO)
        message.header.stamp = stamp_of(nanoseconds - back)
        message.header.frame_id = DOOR_JOINT
        message.period = self._period
        message.first_index = self._index
        message.counts_per_turn = COUNTS_PER_TURN
        message.counts = list(self._counts)
        message.gap_before = self._gap
        self._index += len(self._counts)
        self._counts.clear()
        self._gap = False
        return message


def diagnostics(
    stamp: Time, robot: str, level: bytes, text: str, values: Mapping[str, object]
) -> DiagnosticArray:
    """State of the driver."""
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
