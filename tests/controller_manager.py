"""In place of ros2_control's controller_manager: its topics and its action, and the double's rules.

It controls the simulation in servo mode: a command for each message on /clock. Its broadcaster has
a time of its own, as each of ros2_control's has.
"""

import sys
from typing import Any

import numpy as np
import yaml
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTrajectoryControllerState
from controller_double import PERIOD, ControllerDouble
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.stamps import seconds, stamp_of
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.ros.messages import trajectory_arrays
from rclpy.action import ActionServer, GoalResponse
from rclpy.qos import DurabilityPolicy, QoSProfile
from robot_driver.trajectory_checks import JointLimits
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

JTC = "joint_trajectory_controller"
BROADCASTER = 4e-5  # time of the broadcaster after the controller's [s]
STATES = 4  # cycles between two messages on controller_state


class ControllerManager(GuardedNode):
    """Controls the joints that the description's tags name, as its parameter file says."""

    def __init__(self) -> None:
        super().__init__("controller_manager")
        file = sys.argv[sys.argv.index("--params-file") + 1]
        with open(file, encoding="utf-8") as text:
            self._joints = yaml.safe_load(text)[JTC]["ros__parameters"]["joints"]
        self._double: ControllerDouble | None = None
        self._described = False
        self._measured: Any = None
        self._cycles = 0
        self._commands = self.create_publisher(JointState, "sim/joint_commands", 50)
        self._states = self.create_publisher(JointState, "joint_states", 50)
        self._state = self.create_publisher(
            JointTrajectoryControllerState, f"{JTC}/controller_state", 50)
        self.create_subscription(
            String, "robot_description", self._on_description,
            QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.create_subscription(JointState, "sim/joint_states", self._on_joints, 50)
        self.create_subscription(Clock, "/clock", self._on_clock, 50)
        self.create_subscription(
            JointTrajectory, f"{JTC}/joint_trajectory",
            lambda message: self._take(message) or self.get_logger().error(self._words()), 50)
        ActionServer(
            self, FollowJointTrajectory, f"{JTC}/follow_joint_trajectory", self._succeed,
            goal_callback=lambda goal: GoalResponse(2 if self._take(goal.trajectory) else 1))

    def _on_description(self, message: String) -> None:
        tags = message.data.split("<ros2_control", 1)[1]
        assert all(f'<joint name="{name}">' in tags for name in self._joints)
        self._described = True

    def _on_joints(self, message: JointState) -> None:
        self._measured = message
        time = seconds(message.header.stamp) + BROADCASTER
        message.header.stamp = stamp_of(round(1e9 * time))
        self._states.publish(message)

    def _on_clock(self, message: Clock) -> None:
        """A cycle: read, update, write."""
        if not self._described or self._measured is None:
            return
        time = seconds(message.clock)
        if self._double is None:
            robot, held = load_robot_config(), self._measured
            assert tuple(self._joints) == robot.joint_names
            self._double = ControllerDouble(JointLimits.of(robot), np.array(
                [held.position[held.name.index(name)] for name in self._joints]))
            self._double.reset(self._double.sample(0.0).position, time)
        command = self._double.positions(np.array([time, time + PERIOD]))[-1]
        self._commands.publish(JointState(name=self._joints, position=command.tolist()))
        self._cycles += 1
        if self._cycles % STATES == 0:
            state = JointTrajectoryControllerState(
                joint_names=self._joints, reference=JointTrajectoryPoint(
                    positions=self._double.sample(time).position.tolist()))
            state.header.stamp = message.clock
            self._state.publish(state)

    def _take(self, message: JointTrajectory) -> bool:
        double = self._double
        known = len(double.rejected)
        double.accept(trajectory_arrays(message), seconds(message.header.stamp),
                      seconds(self.get_clock().now().to_msg()))
        return len(double.rejected) == known

    def _words(self) -> str:
        return self._double.rejected[-1]

    def _succeed(self, handle: Any) -> FollowJointTrajectory.Result:
        """Succeed at once: who preempts a goal need not see that end."""
        handle.succeed()
        return FollowJointTrajectory.Result()


if __name__ == "__main__":
    sys.exit(run_node(ControllerManager))
