"""The topics about the robot that the walker reads while there is a goal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from door_impact_common.driver.intake import Arrival
from door_impact_common.driver.messages import joint_arrays, specific_force, trunk_tilt
from door_impact_common.driver.names import IMU, JOINTS, WRENCHES
from door_impact_common.driver.topics import WatchedTopics, Watches
from door_impact_common.node import GuardedNode
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import seconds
from geometry_msgs.msg import PointStamped, WrenchStamped
from humanoid_motion.driver_interface import Command, ImuSample
from humanoid_motion.robot_model import RobotModel
from sensor_msgs.msg import Imu, JointState
from tf2_msgs.msg import TFMessage

from walking.errors import NotReady
from walking.execution.inputs import Inputs
from walking.execution.start import Standing
from walking.ros.messages import base_pose

BASE = "base_link"


class RobotTopics:
    """Passes the messages about the robot to `Inputs`, between `start` and `stop`.

    Args:
        node: Node that subscribes.
        parameters: Parameters of the node with the names in `SILENCE`.
        after: Function that gets the stamp of an event [s] and the commands that follow from it.

    Attributes:
        inputs: The measurements.
        freshness: Age of the last messages.
        topics: The subscriptions.
    """

    def __init__(
        self, node: GuardedNode, robot: RobotModel, parameters: Parameters,
        after: Callable[[float, Sequence[Command]], None],
    ) -> None:
        self._node, self._subscriptions = node, list[Any]()
        self._names = list(robot.joint_names)
        watches = Watches((JOINTS, IMU), parameters)
        self.freshness = watches.freshness
        self.inputs = Inputs(robot.speed_limit, watches.freshness, watches.silence)
        self.topics = WatchedTopics(node, self.inputs, watches, after)

    def start(self) -> None:
        """Subscribe, and forget what was received before."""
        self.inputs.forget()
        self._subscriptions = [
            self.topics.subscribe(JointState, JOINTS, self._on_joints),
            self.topics.subscribe(Imu, IMU, self._on_imu),
            *(self.topics.subscribe(WrenchStamped, topic, partial(self._on_wrench, side))
              for side, topic in WRENCHES.items()),
            self._node.create_subscription(TFMessage, "/tf", self._on_tf, 50),
            self._node.create_subscription(PointStamped, "/zmp", self._on_zmp, 50)]

    def stop(self) -> None:
        """Unsubscribe: a thousand messages a second would be read for nothing."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    @property
    def complete(self) -> bool:
        """Whether joints, IMU and the odometry have arrived."""
        return self.freshness.complete and self.inputs.latest.base is not None

    def standing(self) -> Standing:
        """Return what is known of the robot that stands.

        Raises:
            NotReady: Messages are missing or old.
        """
        stale, latest = self.freshness.refusal(self.topics.now()), self.inputs.latest
        if stale is not None:
            raise NotReady(stale[0], quantity="age [s]", value=stale[1])
        if latest.base is None or latest.joints is None:
            raise NotReady("the odometry has not arrived on /tf yet (odom -> base_link): does "
                           "zmp_publisher run?", quantity="/tf", value=None)
        for topic, names in self.topics.crowded().items():
            self._node.get_logger().warning(
                f"more than one node publishes on {topic}: {', '.join(names)}; one of them may be "
                "foreign")
        _, position, velocity = latest.joints
        return Standing(latest.base, latest.tilt, position, velocity)

    def _on_joints(self, message: JointState, arrival: Arrival) -> list[Command]:
        state = joint_arrays(message, self._names)
        if state is None:
            return self.topics.ignored(
                JOINTS, "it must have the position and the speed of every joint")
        return self.inputs.on_joints(arrival, *state)

    def _on_imu(self, message: Imu, arrival: Arrival) -> list[Command]:
        tilt = trunk_tilt(message)
        if tilt is None:
            return self.topics.ignored(IMU, "it must have an orientation")
        q, rate, force = message.orientation, message.angular_velocity, specific_force(message)
        return self.inputs.on_imu(arrival, tilt, ImuSample(
            np.array([q.x, q.y, q.z, q.w]), np.array([rate.x, rate.y, rate.z]),
            np.zeros(3) if force is None else force))

    def _on_wrench(self, side: str, message: WrenchStamped, arrival: Arrival) -> list[Command]:
        force, torque = message.wrench.force, message.wrench.torque
        return self.inputs.on_wrench(side, arrival, np.array(
            [force.x, force.y, force.z, torque.x, torque.y, torque.z]))

    def _on_tf(self, message: TFMessage) -> None:
        pose = base_pose(message, BASE)
        if pose is not None:
            self.inputs.latest.base = pose

    def _on_zmp(self, message: PointStamped) -> None:
        self.inputs.latest.zmp = (
            seconds(message.header.stamp), np.array([message.point.x, message.point.y]))
