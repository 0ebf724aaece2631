"""A second driver, without PyBullet: the smallest example of what docs/hardware.md asks for.

It moves the robot and the door of kinematic_world.py by the computer's clock, as on a robot, and
speaks the topics of a driver and of a counter board. The test is the person who pushes the door.
"""

import math
import sys
from typing import Any

import numpy as np
import pinocchio as pin
import rclpy
from builtin_interfaces.msg import Time
from door_impact_common.constants import GRAVITY
from door_impact_msgs.msg import EncoderSamples
from door_impact_msgs.srv import PushDoor
from door_model.door.config import load_geometry
from geometry_msgs.msg import WrenchStamped
from kinematic_world import HAND_RADIUS, Body, Leaf, Reference
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from reference_door import ReferenceDoor
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory

NS = 1_000_000_000
TICK = 0.005         # [s] between two joint states
SAMPLE = 0.001       # [s] between two of the counter board's samples
BATCH = 20           # samples
COUNTS_PER_TURN, COUNTER = 14400, 2**16
UPWARDS = np.array([0.0, 0.0, GRAVITY])  # what an accelerometer at rest reads [m/s^2]
GRIPPER = "RHAND_JOINT0"  # the real robot has joints that nobody here knows


class KinematicDriver(Node):
    """The driver's and the counter board's topics."""

    def __init__(self) -> None:
        super().__init__("kinematic_driver")
        number = {name: float(self.declare_parameter(name, default).value) for name, default in {
            "i_a": 12.75, "c_c": 0.06, "k_c": 1.13, "tau_c0_prime": 3.2, "effective_mass": 40.0,
            "restitution": 0.5, "door_distance": 0.753, "hinge_x": -0.4056}.items()}
        geometry = load_geometry("paper")
        linkage = {k: getattr(geometry.linkage, k) for k in ("l", "l1", "l2", "l3", "theta_i0")}
        door = ReferenceDoor(number["i_a"], number["c_c"], number["k_c"], number["tau_c0_prime"],
                             linkage)
        hinge = np.array([number["hinge_x"], -number["door_distance"]])
        self.body = Body()
        self.leaf = Leaf(door, hinge, geometry.leaf.width, number["effective_mass"],
                         number["restitution"])
        self.reference = Reference(self.body.config.half_sitting)
        self._start = self.get_clock().now().nanoseconds
        self._steps = 0
        self._counts: list[int] = []
        self._told = (0.0, 0.0)  # time [s] and impulse on the door [N s] of the last joint state
        self._push = (0.0, 0.0, 1.0)  # impulse [N m s], start and duration [s]
        self._joints = self.create_publisher(JointState, "/joint_states", 10)
        self._imu = self.create_publisher(Imu, "/imu", 10)
        self._feet = [self.create_publisher(WrenchStamped, f"/{side}_foot/wrench", 10)
                      for side in ("left", "right")]
        self._encoder = self.create_publisher(EncoderSamples, "/door_encoder/counts", 10)
        self.create_subscription(JointTrajectory, "/joint_trajectory", self._on_trajectory, 10)
        self.create_service(PushDoor, "~/push", self._on_push)
        self.create_timer(TICK, self._tick)

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return self._steps * SAMPLE

    def _stamp(self, time: float) -> Time:
        ns = self._start + round(time * NS)
        return Time(sec=ns // NS, nanosec=ns % NS)

    def _on_push(self, request: Any, response: Any) -> Any:
        """A person pushes the door: half a sine of torque."""
        self._push = (request.impulse, self.time, request.duration)
        response.success = True
        return response

    def _on_trajectory(self, message: JointTrajectory) -> None:
        if not message.points:
            self.reference.stop(self.time)
            return
        config, given = self.body.config, list(message.joint_names)
        stamp = message.header.stamp
        start = (stamp.sec * NS + stamp.nanosec - self._start) / NS if stamp.sec else self.time
        times = np.array([start + p.time_from_start.sec + p.time_from_start.nanosec / NS
                          for p in message.points])
        if sorted(given) != sorted(config.joint_names) or times[-1] <= self.time:
            self.get_logger().error("refused: other joints, or already over")
            return
        order = [given.index(name) for name in config.joint_names]
        rows = np.array([[np.array(level)[order] for level in
                          (p.positions, p.velocities, p.accelerations) if len(level)]
                         for p in message.points])
        due = times > self.time
        jump = np.abs(rows[due][0, 0] - self.reference.at(self.time)[0]) / max(
            times[due][0] - self.time, TICK)
        inside = (rows[:, 0] >= config.lower - 1e-6) & (rows[:, 0] <= config.upper + 1e-6)
        if not inside.all() or (jump > 1.1 * config.velocity_limit).any():
            self.get_logger().error("refused: beyond a limit, or a jump")
            return
        self.reference.follow(self.time, times[due], rows[due])

    def _tick(self) -> None:
        """Catches up with the computer's clock, then tells where everything is."""
        behind = (self.get_clock().now().nanoseconds - self._start) / NS - self.time
        for _ in range(int(behind / SAMPLE)):
            self._steps += 1
            self._step()
        self._publish()

    def _step(self) -> None:
        impulse, start, length = self._push
        x = (self.time - start) / length
        torque = impulse * math.pi / (2.0 * length) * math.sin(math.pi * x) if x < 1.0 else 0.0
        frames = self.body.place(self.reference.at(self.time)[0])[1]
        self.leaf.step(SAMPLE, torque, (frames[2].translation, self.body.config.contact_radius),
                       (frames[3].translation, HAND_RADIUS))
        turn = self.leaf.angle / (2.0 * math.pi)
        self._counts.append((65500 + round(turn * COUNTS_PER_TURN)) % COUNTER)
        if len(self._counts) == BATCH:
            message = EncoderSamples(period=SAMPLE, first_index=self._steps - BATCH,
                                     counts_per_turn=COUNTS_PER_TURN, counts=self._counts)
            message.header.stamp = self._stamp(self.time - (BATCH - 1) * SAMPLE)
            message.header.frame_id = "door_hinge"
            self._encoder.publish(message)
            self._counts = []

    def _publish(self) -> None:
        stamp = self._stamp(self.time)
        position, velocity, _ = self.reference.at(self.time)
        names = [GRIPPER, *reversed(self.body.config.joint_names)]
        joints = JointState(name=names, position=[0.0, *position[::-1].tolist()],
                            velocity=[0.0, *velocity[::-1].tolist()])
        joints.header.stamp = stamp
        self._joints.publish(joints)
        q, v, a, soles = self.body.motion(self.reference, self.time)
        wrenches = self.body.sole_wrenches(q, v, a, soles)
        # The robot goes on in a hit, so the floor gives it at once what it gives the door, through
        # the soles' faces; moments that it might add would say nothing more.
        told, self._told = self._told, (self.time, self.leaf.impulse)
        hit = (self._told[1] - told[1]) / max(self.time - told[0], TICK)
        for publisher, name, wrench in zip(self._feet, ("l_sole", "r_sole"), wrenches, strict=True):
            message = WrenchStamped()
            message.header.stamp, message.header.frame_id = stamp, name
            force, torque = message.wrench.force, message.wrench.torque
            force.x, force.y, force.z = wrench.linear.tolist()
            force.y -= hit / len(wrenches)  # towards the door
            torque.x, torque.y, torque.z = wrench.angular.tolist()
            publisher.publish(message)
        imu = Imu()
        imu.header.stamp, imu.header.frame_id = stamp, self.body.config.imu_frame
        turn, rate, force = imu.orientation, imu.angular_velocity, imu.linear_acceleration
        turn.x, turn.y, turn.z, turn.w = q[3:7].tolist()
        rate.x, rate.y, rate.z = v[3:6].tolist()
        up = pin.XYZQUATToSE3(q[:7]).rotation.T @ UPWARDS
        force.x, force.y, force.z = (a[:3] + np.cross(v[3:6], v[:3]) + up).tolist()
        self._imu.publish(imu)


def main() -> int:
    """Runs until it is told to end."""
    rclpy.init()
    try:
        rclpy.spin(KinematicDriver())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
