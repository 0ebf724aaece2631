"""Subscriptions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cyclonedds._clayer import ddspy_take
from cyclonedds.core import DDSException
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from ros2_embedded import naming
from ros2_embedded.messages import full_type_name
from ros2_embedded.typehash import type_hash

from rclpy.callback_groups import CallbackGroup
from rclpy.entity import Endpoints, Entity
from rclpy.qos import QoSProfile


class RawReader(DataReader):
    """Hands out samples as they came: CDR behind its header of four bytes."""

    def take(self, N: int = 1, condition: Any = None, instance_handle: Any = None) -> list[bytes]:
        """Takes at most N samples."""
        taken = ddspy_take(self._ref, condition.mask, N)
        if isinstance(taken, int):
            raise DDSException(taken, f"Occurred while taking data in {self!r}")
        return [data for data, info in taken if info.valid_data]


class Subscription(Entity):
    """Calls a function with every message of a topic."""

    def __init__(
        self,
        node: Any,
        msg_type: Any,
        topic: str,
        callback: Callable[[Any], Any],
        qos_profile: QoSProfile,
        group: CallbackGroup | None,
        raw: bool = False,
    ) -> None:
        """Made by `Node.create_subscription`; `topic` is a full name."""
        super().__init__(node, group, 0 if qos_profile.keep_all else qos_profile.depth)
        self.msg_type, self.topic_name, self.qos_profile = msg_type, topic, qos_profile
        self.callback = callback
        user_data = f"typehash={type_hash(full_type_name(msg_type))};"
        participant = node.context.participant
        dds_topic = Topic(participant, naming.topic_name(topic), msg_type)
        make = RawReader if raw else DataReader
        self._reader: Any = make(participant, dds_topic, qos_profile.to_dds(user_data, False))
        self._endpoints = Endpoints(node)
        self._endpoints.add_reader(self._reader, self.receive)

    @property
    def topic(self) -> str:
        """Full name of the topic."""
        return self.topic_name

    def handle(self, sample: Any) -> Any:
        """Calls the callback."""
        if self._reader is not None:
            return self.callback(sample)
        return None

    def get_publisher_count(self) -> int:
        """Number of publishers that it hears."""
        return 0 if self._reader is None else len(self._reader.get_matched_publications())

    def destroy(self) -> None:
        """Ends it: no callback comes afterwards."""
        if self._reader is not None:
            self._endpoints.release()
            self._reader = None
            self._inbox.clear()
