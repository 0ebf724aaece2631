"""Publishers."""

from __future__ import annotations

import ctypes
from typing import Any

from cyclonedds.core import DDSException
from cyclonedds.internal import DDS, dds_c_t
from cyclonedds.pub import DataWriter
from cyclonedds.util import duration
from ros2_embedded import naming
from ros2_embedded.messages import full_type_name
from ros2_embedded.samples import write
from ros2_embedded.thread_safety import make_topic, matched
from ros2_embedded.typehash import type_hash

from rclpy.callback_groups import CallbackGroup
from rclpy.duration import Duration
from rclpy.entity import Endpoints
from rclpy.event_handler import EndpointEvents, EventHandler, PublisherEventCallbacks
from rclpy.exceptions import InvalidHandle, RCLError
from rclpy.qos import QoSProfile
from rclpy.qos_best_available import for_publisher
from rclpy.qos_dds import to_dds


class Publisher:
    """Publishes messages on a topic."""

    def __init__(
        self,
        node: Any,
        msg_type: Any,
        topic: str,
        qos_profile: QoSProfile,
        event_callbacks: PublisherEventCallbacks,
        callback_group: CallbackGroup,
    ) -> None:
        """Made by `Node.create_publisher`; `topic` is the name that the program gave."""
        self.msg_type, self.topic, self.qos_profile = msg_type, topic, qos_profile
        self._topic_name = node.resolve_topic_name(topic)
        self._context = node.context
        chosen = for_publisher(qos_profile, lambda: _wishes(node, self._topic_name))
        user_data = f"typehash={type_hash(full_type_name(msg_type))};"
        participant = node.context.participant
        name = naming.dds_topic(self._topic_name, qos_profile.avoid_ros_namespace_conventions)
        dds_topic = make_topic(participant, name, msg_type)
        self._writer: Any = DataWriter(participant, dds_topic, to_dds(chosen, user_data, True))
        self._endpoints = Endpoints(node)
        self._endpoints.add_writer(self._writer)
        events = event_callbacks.events(node, topic)
        self._events = EndpointEvents(node, callback_group, self._writer, events)

    @property
    def topic_name(self) -> str:
        """Full name of the topic; raises InvalidHandle if it was destroyed."""
        self._living()
        return self._topic_name

    @property
    def event_handlers(self) -> list[EventHandler]:
        """The handlers that call the functions for events."""
        return self._events.handlers

    def publish(self, msg: Any) -> None:
        """Publishes a message, or its bytes: a header and CDR.

        Raises:
            TypeError: a message of another type.
            InvalidHandle: after `destroy`.
            RCLError: after the shutdown, or the bytes are no message of the type.
        """
        writer = self._writer
        if writer is None:
            self._refuse()
        if isinstance(msg, self.msg_type):
            data = msg.serialize()
        elif isinstance(msg, bytes):
            data = msg
        else:
            raise TypeError(f"Expected {self.msg_type}, got {type(msg)}")
        try:
            write(writer, data)
        except DDSException as error:
            raise RCLError(f"Failed to publish: {error}") from error

    def _refuse(self) -> None:
        # After Ctrl-C or SIGTERM a callback may finish: only `shutdown` ends the publisher.
        if self._context.background is None:
            raise RCLError("Failed to publish: publisher's context is invalid")
        raise InvalidHandle("cannot use Destroyable because destruction was requested")

    def _living(self) -> Any:
        if self._writer is None:
            self._refuse()
        return self._writer

    def get_subscription_count(self) -> int:
        """Number of subscriptions that get what is published."""
        return len(matched(self._living().get_matched_subscriptions))

    def assert_liveliness(self) -> None:
        """Asserts that the publisher is alive, if its liveliness is MANUAL_BY_TOPIC."""
        result = DDS._dll_handle.dds_assert_liveliness(dds_c_t.entity(self._living()._ref))
        if ctypes.c_int32(result).value < 0:
            raise RCLError("Failed to assert liveliness on the Publisher")

    def wait_for_all_acked(self, timeout: Duration = Duration(seconds=-1)) -> bool:  # noqa: B008
        """Waits until all reliable subscriptions have everything; False if they do not in time."""
        limit = timeout.nanoseconds
        return bool(self._living().wait_for_acks(duration(infinite=True) if limit < 0 else limit))

    def destroy(self) -> None:
        """Ends it."""
        if self._writer is not None:
            self._events.release()
            self._endpoints.release()
            self._writer = None


def _wishes(node: Any, topic: str) -> list[QoSProfile]:
    return [info.qos_profile for info in node.get_subscriptions_info_by_topic(topic)]
