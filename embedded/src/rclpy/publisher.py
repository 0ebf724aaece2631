"""Publishers."""

from __future__ import annotations

from typing import Any

from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from ros2_embedded import naming
from ros2_embedded.messages import full_type_name
from ros2_embedded.typehash import type_hash

from rclpy.duration import Duration
from rclpy.entity import Endpoints
from rclpy.exceptions import RCLError
from rclpy.qos import QoSProfile


class Publisher:
    """Publishes messages on a topic."""

    def __init__(self, node: Any, msg_type: Any, topic: str, qos_profile: QoSProfile) -> None:
        """Made by `Node.create_publisher`; `topic` is a full name."""
        self.msg_type, self.topic_name, self.qos_profile = msg_type, topic, qos_profile
        user_data = f"typehash={type_hash(full_type_name(msg_type))};"
        participant = node.context.participant
        dds_topic = Topic(participant, naming.topic_name(topic), msg_type)
        self._writer: Any = DataWriter(participant, dds_topic, qos_profile.to_dds(user_data, True))
        self._endpoints = Endpoints(node)
        self._endpoints.add_writer(self._writer)

    @property
    def topic(self) -> str:
        """Full name of the topic."""
        return self.topic_name

    def publish(self, msg: Any) -> None:
        """Publishes a message.

        Raises:
            TypeError: a message of another type.
            RCLError: after the shutdown, or after `destroy`.
        """
        if type(msg) is not self.msg_type:
            raise TypeError(f"Expected {self.msg_type.__name__}, got {type(msg).__name__}")
        # After Ctrl-C or SIGTERM a callback may finish: only `shutdown` ends the publisher.
        if self._writer is None:
            raise RCLError("Failed to publish: publisher's context is invalid")
        self._writer.write(msg)

    def get_subscription_count(self) -> int:
        """Number of subscriptions that get what is published."""
        return 0 if self._writer is None else len(self._writer.get_matched_subscriptions())

    def wait_for_all_acked(self, timeout: Duration | None = None) -> bool:
        """Waits until all reliable subscriptions have everything; False if they do not."""
        limit = duration(infinite=True) if timeout is None else timeout.nanoseconds
        return bool(self._writer.wait_for_acks(limit))

    def destroy(self) -> None:
        """Ends it."""
        if self._writer is not None:
            self._endpoints.release()
            self._writer = None
