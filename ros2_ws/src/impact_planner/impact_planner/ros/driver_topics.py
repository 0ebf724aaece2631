"""The topics of robot and door that the executor reads, and the watch over them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from door_impact_common.node import GuardedNode
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import seconds
from geometry_msgs.msg import WrenchStamped
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel
from rclpy.clock import Clock, ClockType, JumpThreshold
from rclpy.duration import Duration
from sensor_msgs.msg import Imu, JointState

from impact_planner.execution.freshness import Freshness
from impact_planner.execution.inputs import DOOR, IMU, JOINTS, WRENCHES, Inputs
from impact_planner.execution.intake import Arrival
from impact_planner.execution.types import Command
from impact_planner.ros.executor_messages import (
    diagnostics,
    joint_arrays,
    specific_force,
    trunk_tilt,
)

WATCH_PERIOD = 0.05  # time between two checks that messages arrive [s]
DIAGNOSTICS_PERIOD = 1.0  # time between two messages on /diagnostics [s]
WARNING_PERIOD = 5.0  # shortest time between two warnings about unusable messages [s]
TRAJECTORY = "/joint_trajectory"
SILENCE = {
    "stale_after": (0.5, "largest age of messages about robot and door [s]"),
    "silent_after": (5.0, "time without a message about robot or door, by the computer's clock, "
                     "after which a motion ends although the clock of a simulation stands [s]"),
}


class DriverTopics:
    """Passes the messages about robot and door to `Inputs`, and watches that they arrive.

    Args:
        node: Node that subscribes.
        robot: The robot.
        parameters: Parameters of the node with the names in `SILENCE`.
        after: Function that gets the stamp of an event [s] and the commands that follow from it.

    Attributes:
        inputs: The measurements.
        freshness: Age of the last messages.
    """

    def __init__(
        self, node: GuardedNode, robot: RobotModel, parameters: Parameters,
        after: Callable[[float, list[Command]], None],
    ) -> None:
        self._node, self._after = node, after
        self._names = list(robot.joint_names)
        topics = (JOINTS, IMU, DOOR)
        self.freshness = Freshness(topics, parameters.number("stale_after"), WATCH_PERIOD)
        silence = Freshness(topics, parameters.number("silent_after"), WATCH_PERIOD)
        self.inputs = Inputs(robot.speed_limit, self.freshness, silence)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        node.create_subscription(JointState, JOINTS, self._input(self._on_joints), 50)
        node.create_subscription(JointState, DOOR, self._input(self._on_door), 50)
        node.create_subscription(Imu, IMU, self._input(self._on_imu), 50)
        for side in SIDES:
            node.create_subscription(WrenchStamped, WRENCHES[side],
                                     self._input(partial(self._on_wrench, side)), 50)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(WATCH_PERIOD, partial(self._watch, self.freshness))
        node.create_timer(WATCH_PERIOD, partial(self._watch, silence), clock=steady)
        node.create_timer(DIAGNOSTICS_PERIOD, self._report, clock=steady)
        self._jumps = node.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1),
                          on_clock_change=False),
            post_callback=self._clock_went_back)

    def _input(self, handle: Callable[[Any, Arrival], list[Command]]) -> Callable[..., None]:
        """Make the callback of a topic about robot or door.

        Args:
            handle: Function that gets the message and its times, and returns commands.
        """
        def callback(message: Any, info: dict[str, Any]) -> None:
            stamp, sent = seconds(message.header.stamp), info["source_timestamp"]
            underway = 1e-9 * (time.time_ns() - sent) if sent else 0.0
            with self._ends_the_motion():
                self._after(stamp, handle(message, Arrival(stamp, self.now(), underway)))
        return callback

    @contextmanager
    def _ends_the_motion(self) -> Iterator[None]:
        """End the motion where an error of the program is raised; the node's guard logs it."""
        try:
            yield
        except Exception as error:  # a motion must not go on without its executor
            self._after(-math.inf, self.inputs.on_failure(error))
            raise

    def now(self) -> float:
        """Present time of the robot's clock [s]."""
        return float(self._node.get_clock().now().nanoseconds * 1e-9)

    def _on_joints(self, message: JointState, arrival: Arrival) -> list[Command]:
        state = joint_arrays(message, self._names)
        if state is None:
            self._ignored(JOINTS, "it must have the position and the speed of every joint")
            return []
        return self.inputs.on_joints(arrival, *state)

    def _on_door(self, message: JointState, arrival: Arrival) -> list[Command]:
        if not (message.position and message.velocity):
            self._ignored(DOOR, "it must have the door's angle and angular velocity")
            return []
        return self.inputs.on_door(arrival, message.position[0], message.velocity[0])

    def _on_imu(self, message: Imu, arrival: Arrival) -> list[Command]:
        tilt, rate = trunk_tilt(message), message.angular_velocity
        if tilt is None:
            self._ignored(IMU, "it must have an orientation")
            return []
        return self.inputs.on_imu(arrival, tilt, np.array([rate.x, rate.y, rate.z]),
                                  specific_force(message))

    def _on_wrench(self, side: str, message: WrenchStamped, arrival: Arrival) -> list[Command]:
        """Pass on the force towards the door.

        The soles are parallel to odom, in which the door is in the direction of -y.
        """
        return self.inputs.on_wrench(side, arrival, -message.wrench.force.y)

    def _ignored(self, topic: str, why: str) -> None:
        self._node.get_logger().warning(f"a message on {topic} was ignored: {why}",
                                  throttle_duration_sec=WARNING_PERIOD)

    def _clock_went_back(self, _: Any) -> None:
        """Give up the motion: after a reset of the simulation its times mean nothing any more."""
        self.inputs.forget()
        self._after(-math.inf, [])

    def _watch(self, watch: Freshness) -> None:
        """End a motion if messages about robot or door do not arrive any more."""
        missing = watch.tick()
        if missing is None or self.inputs.joints is None:
            return
        with self._ends_the_motion():
            self._after(self.inputs.joints[0], self.inputs.on_silence(*missing, watch.limit))

    def _report(self) -> None:
        """Publish what was dropped or late, and who publishes beside the driver."""
        self._diagnostics.publish(diagnostics(
            self.inputs.intake, self.crowded(), self._node.get_clock().now().to_msg()))

    def crowded(self) -> dict[str, list[str]]:
        """Names of the nodes that publish on a topic, for topics with more than one publisher."""
        publishers = {
            topic: sorted(f"{one.node_namespace.rstrip('/')}/{one.node_name}"
                          for one in self._node.get_publishers_info_by_topic(topic))
            for topic in (JOINTS, IMU, DOOR, *WRENCHES.values(), TRAJECTORY)}
        return {topic: names for topic, names in publishers.items() if len(names) > 1}
