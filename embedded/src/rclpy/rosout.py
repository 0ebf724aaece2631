"""The topic `/rosout`: what a node logs, for others."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.duration import Duration, split_nanoseconds
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.exceptions import InvalidHandle, RCLError
from rclpy.impl.log_output import Record, outputs
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.weak_method import weakly

_TOPIC = "/rosout"


class Rosout:
    """Publishes what a node's logger, and those made from it, write."""

    def __init__(self, node: Any) -> None:
        """Starts."""
        self._log = message_class("rcl_interfaces/msg/Log")
        latched = DurabilityPolicy.TRANSIENT_LOCAL
        qos = QoSProfile(depth=1000, durability=latched, lifespan=Duration(seconds=10))
        events = PublisherEventCallbacks(use_default_callbacks=False)
        group = node.default_callback_group
        self._publisher = Publisher(node, self._log, _TOPIC, qos, events, group)
        publish = weakly(self._publish)
        outputs.rosout.setdefault(node.get_logger().name, publish)
        self._forget = weakref.finalize(self, _forget, publish)
        self._forget.atexit = False

    def _publish(self, record: Record) -> None:
        message = self._log(
            stamp=message_class("builtin_interfaces/msg/Time")(**split_nanoseconds(record.stamp)),
            level=int(record.severity),
            name=record.name,
            msg=record.message,
            file=record.file,
            function=record.function,
            line=record.line,
        )
        with suppress(InvalidHandle, RCLError):  # the node was destroyed meanwhile
            self._publisher.publish(message)

    def destroy(self) -> None:
        """Ends."""
        self._forget()
        self._publisher.destroy()


def _forget(publish: Callable[..., None]) -> None:
    """Removes a publisher from its node's logger and from that logger's children."""
    for name, other in list(outputs.rosout.items()):
        if other is publish:
            outputs.rosout.pop(name, None)
