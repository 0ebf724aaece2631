"""The topics of robot and door that the executor reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from door_impact_common.driver.intake import Arrival
from door_impact_common.driver.messages import joint_arrays, specific_force, trunk_tilt
from door_impact_common.driver.names import IMU, JOINTS, WRENCHES
from door_impact_common.driver.topics import WatchedTopics, Watches
from door_impact_common.node import GuardedNode
from door_impact_common.parameters import Parameters
from geometry_msgs.msg import WrenchStamped
from humanoid_motion.driver_interface import Command
from humanoid_motion.robot_model import RobotModel
from sensor_msgs.msg import Imu, JointState

from impact_planner.execution.inputs import DOOR, Inputs


class DriverTopics:
    """Passes the messages about robot and door to `Inputs`.

    Args:
        node: Node that subscribes.
        robot: The robot.
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
        self._names = list(robot.joint_names)
        watches = Watches((JOINTS, IMU, DOOR), parameters)
        self.freshness = watches.freshness
        self.inputs = Inputs(robot.speed_limit, watches.freshness, watches.silence)
        self.topics = WatchedTopics(node, self.inputs, watches, after)
        self.topics.subscribe(JointState, JOINTS, self._on_joints)
        self.topics.subscribe(JointState, DOOR, self._on_door)
        self.topics.subscribe(Imu, IMU, self._on_imu)
        for side, topic in WRENCHES.items():
            self.topics.subscribe(WrenchStamped, topic, partial(self._on_wrench, side))

    def _on_joints(self, message: JointState, arrival: Arrival) -> list[Command]:
        state = joint_arrays(message, self._names)
        if state is None:
            return self.topics.ignored(
                JOINTS, "it must have the position and the speed of every joint")
        return self.inputs.on_joints(arrival, *state)

    def _on_door(self, message: JointState, arrival: Arrival) -> list[Command]:
        if not (message.position and message.velocity):
            return self.topics.ignored(DOOR, "it must have the door's angle and angular velocity")
        return self.inputs.on_door(arrival, message.position[0], message.velocity[0])

    def _on_imu(self, message: Imu, arrival: Arrival) -> list[Command]:
        tilt, rate = trunk_tilt(message), message.angular_velocity
        if tilt is None:
            return self.topics.ignored(IMU, "it must have an orientation")
        return self.inputs.on_imu(arrival, tilt, np.array([rate.x, rate.y, rate.z]),
                                  specific_force(message))

    def _on_wrench(self, side: str, message: WrenchStamped, arrival: Arrival) -> list[Command]:
        """Pass on the force towards the door.

        The soles are parallel to odom, in which the door is in the direction of -y.
        """
        return self.inputs.on_wrench(side, arrival, -message.wrench.force.y)
