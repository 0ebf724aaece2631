"""Sends trajectories to a robot's driver, or to ros2_control's controller by topic or action."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from action_msgs.msg import GoalStatus
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from door_impact_common.node import GuardedNode
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import seconds
from humanoid_motion.mirror import Straight
from rclpy.action import ActionClient
from robot_driver.messages import joint_arrays
from robot_driver.names import TRAJECTORY
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

PARAMETERS = {
    "controller": ("", "name of the ros2_control controller that gets trajectories, such as "
                   "joint_trajectory_controller; empty: a driver that takes joint_trajectory"),
    "interface": ("topic", "topic or action: by which of the two the controller gets them"),
}
_QUEUE = 50
_OLDEST = 0.5  # longest time without a word of the controller before a motion [s]


class Controller:
    """The robot's controller, or its driver.

    Args:
        node: The node; it gets the parameters `PARAMETERS`.
        names: Names of the joints.
        sight: How robot and door are seen.
        follows: Function that gets what the controller says that it follows: stamp [s] and joint
            positions, (J,) [rad].
        refused: Function that gets the controller's words about a trajectory that it does not
            follow.

    Raises:
        SettingError: `interface` is neither topic nor action, or control_msgs is not installed.
    """

    def __init__(
        self, node: GuardedNode, names: list[str], sight: Straight,
        follows: Callable[[float, Array], None], refused: Callable[[str], None],
    ) -> None:
        given = Parameters(node, PARAMETERS)
        self._node, self._names, self._sight = node, names, sight
        self._follows, self._refused = follows, refused
        self._name, interface = given.text("controller"), given.choice(
            "interface", ("topic", "action"))
        self._topic = self._action = None
        self._latest = 0  # number of the last goal
        self._said = -math.inf  # when the controller has told what it follows [s]
        if not self._name:
            self._topic = node.create_publisher(JointTrajectory, TRAJECTORY, 10)
            return
        try:
            from control_msgs.action import FollowJointTrajectory
            from control_msgs.msg import JointTrajectoryControllerState
        except ImportError as error:
            raise SettingError("controller", self._name, "empty where the package control_msgs of "
                               "ros2_control is not installed") from error
        self._goal = FollowJointTrajectory.Goal
        node.create_subscription(JointTrajectoryControllerState, f"{self._name}/controller_state",
                                 self._on_state, _QUEUE)
        if interface == "action":
            self._action = ActionClient(
                node, FollowJointTrajectory, f"{self._name}/follow_joint_trajectory")
        else:
            self._topic = node.create_publisher(
                JointTrajectory, f"{self._name}/joint_trajectory", 10)

    @property
    def silence(self) -> str:
        """Why no motion can begin; empty if one can."""
        age = self._now() - self._said
        return "" if not self._name or age <= _OLDEST else (
            f"no message has arrived on {self._name}/controller_state"
            + (f" for {age:.2f} s" if age < math.inf else "") + ": is the controller active?")

    def send(self, message: JointTrajectory) -> None:
        """Send a trajectory; one of the action takes the place of that before it."""
        if self._topic is not None:
            self._topic.publish(message)
            return
        assert self._action is not None
        self._latest += 1
        if not self._action.server_is_ready():
            self._refused(f"nobody serves {self._name}/follow_joint_trajectory")
            return
        self._action.send_goal_async(self._goal(trajectory=message)).add_done_callback(
            partial(self._answered, self._latest))

    def _answered(self, number: int, future: Any) -> None:
        handle = future.result()
        if handle.accepted:
            handle.get_result_async().add_done_callback(partial(self._ended, number))
        elif number == self._latest:
            self._refused(f"the controller {self._name} rejected a trajectory; its log says why")

    def _ended(self, number: int, future: Any) -> None:
        """Handle the end of a goal; that of an earlier one is the rule and says nothing."""
        answer = future.result()
        if number == self._latest and answer.status != GoalStatus.STATUS_SUCCEEDED:
            self._refused(f"the controller {self._name} gave a trajectory up: "
                          f"{answer.result.error_string} (code {answer.result.error_code})")

    def _on_state(self, message: Any) -> None:
        self._said, point = self._now(), message.reference
        state = joint_arrays(self._sight.message(JointState(
            name=list(message.joint_names), position=point.positions,
            velocity=point.velocities or np.zeros(len(point.positions)))), self._names)
        if state is not None:
            self._follows(seconds(message.header.stamp), state[0])

    def _now(self) -> float:
        return float(1e-9 * self._node.get_clock().now().nanoseconds)
