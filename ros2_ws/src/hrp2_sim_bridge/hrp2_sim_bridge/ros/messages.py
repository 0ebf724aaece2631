"""Conversions between the simulation's dataclasses and the messages of the driver's topics."""

from __future__ import annotations

from array import array

from builtin_interfaces.msg import Time
from door_impact_common.arrays import Array
from door_impact_common.stamps import NANOSECONDS, seconds
from geometry_msgs.msg import WrenchStamped
from hrp2_description.robot import SIDES
from humanoid_motion.driver_interface import TickSample, TrajectoryArrays
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory

from hrp2_sim_bridge.physics.engine import SimulatedRobot
from hrp2_sim_bridge.sensors.imu import ImuVariances


def trajectory_arrays(message: JointTrajectory) -> TrajectoryArrays:
    """Return the content of a trajectory message, unchecked."""
    points = message.points
    return TrajectoryArrays(
        joint_names=list(message.joint_names),
        times=[seconds(point.time_from_start) for point in points],
        positions=[list(point.positions) for point in points],
        velocities=[list(point.velocities) for point in points],
        accelerations=[list(point.accelerations) for point in points])


class TickMessages:
    """Messages of a tick, made once and filled anew: a publisher copies what it is given.

    Args:
        robot: Configuration of the robot.
        variances: Variances of the IMU's readings.
        prefix: Text before the names of the frames.

    Attributes:
        stamp: Stamp of all these messages.
        joints: Joint positions [rad], velocities [rad/s] and torques [N m].
        imu: Reading of the IMU, with the variances on the covariances' diagonals.
        wrenches: Forces [N] and torques [N m] on the left and the right sole, and on the left and
            the right hand if their wrists have sensors.
    """

    def __init__(self, robot: SimulatedRobot, variances: ImuVariances, prefix: str = "") -> None:
        self.stamp = Time()
        self.joints = JointState(name=list(robot.joint_names))
        self.imu = Imu()
        self.imu.header.frame_id = prefix + robot.imu_frame
        self.imu.orientation_covariance[::4] = variances.orientation
        self.imu.angular_velocity_covariance[::4] = variances.angular_velocity
        self.imu.linear_acceleration_covariance[::4] = variances.specific_force
        frames = [robot.feet[side].sole for side in SIDES]
        if robot.wrist_sensors is not None:
            frames += [robot.wrist_sensors[side].link for side in SIDES]
        self.wrenches = [WrenchStamped() for _ in frames]
        for message, frame in zip(self.wrenches, frames, strict=True):
            message.header.frame_id = prefix + frame
        for message in (self.joints, self.imu, *self.wrenches):
            message.header.stamp = self.stamp

    def fill(self, nanoseconds: int, sample: TickSample) -> None:
        """Fill the messages with what was measured at a time [ns]."""
        self.stamp.sec, self.stamp.nanosec = divmod(nanoseconds, NANOSECONDS)
        self.joints.position = _numbers(sample.position)
        self.joints.velocity = _numbers(sample.velocity)
        self.joints.effort = _numbers(sample.effort)
        read, message = sample.imu, self.imu
        turn, rate, force = (
            message.orientation, message.angular_velocity, message.linear_acceleration)
        turn.x, turn.y, turn.z, turn.w = read.orientation.tolist()
        rate.x, rate.y, rate.z = read.angular_velocity.tolist()
        force.x, force.y, force.z = read.specific_force.tolist()
        measured = (sample.left_wrench, sample.right_wrench,
                    sample.left_hand_wrench, sample.right_hand_wrench)
        for stamped, values in zip(self.wrenches, measured, strict=False):
            if values is not None:
                f, t = stamped.wrench.force, stamped.wrench.torque
                f.x, f.y, f.z, t.x, t.y, t.z = values.tolist()


def _numbers(values: Array) -> array[float]:
    return array("d", values.tobytes())
