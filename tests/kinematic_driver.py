"""A second driver, without PyBullet: the smallest example of what docs/driver.md asks for.

It moves the robot and the door of kinematic_robot.py by the computer's clock, as on a robot, and
has the topics of a driver and of a counter board. The test plays the person who pushes the door.
"""

import sys
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.stamps import NANOSECONDS, nanoseconds, seconds, stamp_of
from door_impact_msgs.msg import EncoderSamples
from door_impact_msgs.srv import PushDoor
from door_model.door.config import load_geometry
from geometry_msgs.msg import WrenchStamped
from humanoid_motion.driver_interface import TickSample, TrajectoryArrays
from kinematic_robot import COUNTS_PER_TURN, SAMPLE, TICK, KinematicRobot, Leaf, RefusedError
from reference_door import ReferenceDoor
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory

BATCH = 20  # samples of the counter board in a message
GRIPPER = "RHAND_JOINT0"  # the real robot has joints that no node here knows


class KinematicDriver(GuardedNode):
    """The topics of the driver and of the counter board."""

    def __init__(self) -> None:
        super().__init__("kinematic_driver")
        number = {name: float(self.declare_parameter(name, default).value) for name, default in {
            "i_a": 12.75, "c_c": 0.06, "k_c": 1.13, "tau_c0_prime": 3.2, "effective_mass": 40.0,
            "restitution": 0.5, "door_distance": 0.715, "hinge_x": -0.4056}.items()}
        geometry = load_geometry("paper")
        linkage = {k: getattr(geometry.linkage, k) for k in ("l", "l1", "l2", "l3", "theta_i0")}
        closer = {name: number[name] for name in ("i_a", "c_c", "k_c", "tau_c0_prime")}
        door = ReferenceDoor(**closer, linkage=linkage)
        hinge = np.array([number["hinge_x"], -number["door_distance"]])
        self.robot = KinematicRobot(Leaf(door, hinge, geometry.leaf.width,
                                         number["effective_mass"], number["restitution"]))
        self._start = self.get_clock().now().nanoseconds
        self._samples = 0
        self._counts: list[int] = []
        self._joints = self.create_publisher(JointState, "joint_states", 10)
        self._imu = self.create_publisher(Imu, "imu", 10)
        self._feet = [self.create_publisher(WrenchStamped, f"{side}_foot/wrench", 10)
                      for side in ("left", "right")]
        self._encoder = self.create_publisher(EncoderSamples, "door_encoder/counts", 10)
        self.create_subscription(JointTrajectory, "joint_trajectory", self._on_trajectory, 10)
        self.create_service(PushDoor, "~/push", self._on_push)
        self.create_timer(TICK, self._catch_up)

    def _stamp(self, time: float) -> Time:
        return stamp_of(self._start + round(time * NANOSECONDS))

    def _on_push(self, request: Any, response: Any) -> Any:
        """Push the door as a person does."""
        self.robot.push_door(request.impulse, request.duration)
        response.success = True
        return response

    def _on_trajectory(self, message: JointTrajectory) -> None:
        points, stamp = message.points, message.header.stamp
        start = (nanoseconds(stamp) - self._start) / NANOSECONDS if stamp.sec else 0.0
        try:
            self.robot.follow(TrajectoryArrays(
                message.joint_names, [seconds(p.time_from_start) for p in points],
                [p.positions for p in points], [p.velocities for p in points],
                [p.accelerations for p in points]), start)
        except RefusedError as error:
            self.get_logger().error(f"refused: {error}")

    def _catch_up(self) -> None:
        """Step the robot up to the computer's clock and publish each tick."""
        now = (self.get_clock().now().nanoseconds - self._start) / NANOSECONDS
        while self.robot.time + TICK <= now:
            self._publish(self.robot.step())

    def _publish(self, sample: TickSample) -> None:
        stamp, config = self._stamp(sample.time), self.robot.config
        names = [GRIPPER, *reversed(config.joint_names)]
        joints = JointState(name=names, position=[0.0, *sample.position[::-1].tolist()],
                            velocity=[0.0, *sample.velocity[::-1].tolist()])
        joints.header.stamp = stamp
        self._joints.publish(joints)
        for publisher, name, wrench in zip(
                self._feet, ("l_sole", "r_sole"), (sample.left_wrench, sample.right_wrench),
                strict=True):
            message = WrenchStamped()
            message.header.stamp, message.header.frame_id = stamp, name
            force, torque = message.wrench.force, message.wrench.torque
            force.x, force.y, force.z, torque.x, torque.y, torque.z = wrench.tolist()
            publisher.publish(message)
        imu = Imu()
        imu.header.stamp, imu.header.frame_id = stamp, config.imu_frame
        turn, rate, force = imu.orientation, imu.angular_velocity, imu.linear_acceleration
        turn.x, turn.y, turn.z, turn.w = sample.imu.orientation.tolist()
        rate.x, rate.y, rate.z = sample.imu.angular_velocity.tolist()
        force.x, force.y, force.z = sample.imu.specific_force.tolist()
        self._imu.publish(imu)
        self._counts += sample.counts
        if len(self._counts) >= BATCH:
            counts = EncoderSamples(period=SAMPLE, first_index=self._samples,
                                    counts_per_turn=COUNTS_PER_TURN, counts=self._counts)
            counts.header.stamp = self._stamp(sample.time - (len(self._counts) - 1) * SAMPLE)
            counts.header.frame_id = "door_hinge"
            self._encoder.publish(counts)
            self._samples += len(self._counts)
            self._counts = []


if __name__ == "__main__":
    sys.exit(run_node(KinematicDriver))
