"""Subscriptions."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from enum import Enum
from typing import Any

from cyclonedds.sub import DataReader
from ros2_embedded import naming
from ros2_embedded.messages import full_type_name
from ros2_embedded.samples import Sample
from ros2_embedded.thread_safety import make_topic, matched
from ros2_embedded.typehash import type_hash

from rclpy.callback_groups import CallbackGroup
from rclpy.entity import Entity
from rclpy.event_handler import EndpointEvents, EventHandler, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.qos import QoSProfile
from rclpy.qos_best_available import for_subscription
from rclpy.qos_dds import to_dds


def _accepts(callback: Callable[..., Any], count: int) -> bool:
    try:
        inspect.signature(callback).bind(*range(count))
    except TypeError:
        return False
    return True


class Subscription(Entity):
    """Calls a function with every message of a topic."""

    class CallbackType(Enum):
        """Whether the callback has a second argument, the times of the message."""

        MessageOnly = 0
        WithMessageInfo = 1

    def __init__(
        self,
        node: Any,
        msg_type: Any,
        topic: str,
        callback: Callable[..., Any],
        qos_profile: QoSProfile,
        callback_group: CallbackGroup,
        raw: bool,
        event_callbacks: SubscriptionEventCallbacks,
    ) -> None:
        """Made by `Node.create_subscription`; `topic` is the name that the program gave."""
        depth = 0 if qos_profile.keep_all else max(qos_profile.depth, 1)
        super().__init__(node, callback_group, depth)
        self.msg_type, self.topic, self.qos_profile = msg_type, topic, qos_profile
        self.raw, self.callback = raw, callback
        self._topic_name = node.resolve_topic_name(topic)
        chosen = for_subscription(qos_profile, lambda: _offers(node, self._topic_name))
        user_data = f"typehash={type_hash(full_type_name(msg_type))};"
        participant = node.context.participant
        name = naming.dds_topic(self._topic_name, qos_profile.avoid_ros_namespace_conventions)
        dds_topic = make_topic(participant, name, msg_type)
        self._reader: Any = DataReader(participant, dds_topic, to_dds(chosen, user_data, False))
        self._endpoints.add_reader(self._reader, self.receive)
        events = event_callbacks.events(node, topic)
        self._events = EndpointEvents(node, self.callback_group, self._reader, events)

    @property
    def topic_name(self) -> str:
        """Full name of the topic; raises InvalidHandle if it was destroyed."""
        self._check()
        return self._topic_name

    @property
    def event_handlers(self) -> list[EventHandler]:
        """The handlers that call the functions for events."""
        return self._events.handlers

    @property
    def callback(self) -> Callable[..., Any]:
        """The function that receives each message, and its times if it has two arguments."""
        return self._callback

    @callback.setter
    def callback(self, value: Callable[..., Any]) -> None:
        for kind, count in (
            (self.CallbackType.MessageOnly, 1),
            (self.CallbackType.WithMessageInfo, 2),
        ):
            if _accepts(value, count):
                self._callback, self._callback_type = value, kind
                return
        raise RuntimeError(
            "Subscription.__init__(): callback should be either be callable with one argument"
            "(to get only the message) or two (to get message and message info)"
        )

    def handle(self, sample: Sample) -> Any:
        """Calls the callback."""
        if self._reader is None:
            return None
        data, info = sample
        message = data if self.raw else self.msg_type.deserialize(data)
        if self._callback_type is self.CallbackType.MessageOnly:
            return self._callback(message)
        return self._callback(
            message,
            {
                "source_timestamp": info.source_timestamp,
                "received_timestamp": time.time_ns(),
                "publication_sequence_number": None,
                "reception_sequence_number": None,
            },
        )

    def _check(self) -> None:
        if self._reader is None:
            raise InvalidHandle("cannot use Destroyable because destruction was requested")

    def get_publisher_count(self) -> int:
        """Number of matched publishers."""
        self._check()
        return len(matched(self._reader.get_matched_publications))

    def destroy(self) -> None:
        """Ends it: no callback comes afterwards."""
        if self._reader is not None:
            self._events.release()
            self._endpoints.release()
            self._reader = None
            self._inbox.clear()


def _offers(node: Any, topic: str) -> list[QoSProfile]:
    return [info.qos_profile for info in node.get_publishers_info_by_topic(topic)]
