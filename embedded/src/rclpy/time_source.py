"""Simulated time: what sets a node's clock by `/clock`."""

from __future__ import annotations

from typing import Any

from ros2_embedded.messages import message_class

from rclpy.clock import ROSClock
from rclpy.clock_type import ClockType
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_clock
from rclpy.time import Time


class TimeSource:
    """Follows a node's parameter `use_sim_time`."""

    def __init__(self, node: Any, clock: ROSClock) -> None:
        """Serves the node's clock; `follow` says whether time is simulated."""
        self._node, self._clock = node, clock
        self._subscription: Any = None
        clock.set_ros_time_override(Time(clock_type=ClockType.ROS_TIME))

    def follow(self, parameters: list[Parameter]) -> None:
        """Begins or ends simulated time as `use_sim_time`, if it is among them, says."""
        for parameter in parameters:
            if parameter.name != "use_sim_time":
                continue
            if parameter.value and self._subscription is None:
                self._subscription = self._node.create_subscription(
                    message_class("rosgraph_msgs/msg/Clock"), "/clock", self._on_clock,
                    qos_profile_clock,
                )  # fmt: skip
            elif not parameter.value and self._subscription is not None:
                self._node.destroy_subscription(self._subscription)
                self._subscription = None
            self._clock._set_ros_time_is_active(bool(parameter.value))

    def _on_clock(self, message: Any) -> None:
        self._clock.set_ros_time_override(Time.from_msg(message.clock))
