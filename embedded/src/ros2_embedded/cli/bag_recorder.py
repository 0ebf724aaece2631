"""The recorder behind `ros2 bag record`."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rosbags.interfaces import Connection
from rosbags.rosbag2 import WriterError

from ros2_embedded.bag_writer import BagWriter
from ros2_embedded.cli.command_node import settle
from ros2_embedded.cli.common import CliError
from ros2_embedded.message_modules import interface_class
from ros2_embedded.naming import is_hidden
from ros2_embedded.specs import InterfaceError

_QUEUE = 1000
"""Queue depth of a topic: 5 s at 200 Hz."""
_BREATH = 0.1
"""Longest time until a signal is noticed [s]."""


@dataclass(frozen=True)
class Choice:
    """The options that decide which topics are recorded."""

    every: bool = False
    topics: list[str] = field(default_factory=list)
    types: list[str] = field(default_factory=list)
    regex: str = ""
    hidden: bool = False
    unpublished: bool = False
    unheard: bool = True
    without_topics: list[str] = field(default_factory=list)
    without_types: list[str] = field(default_factory=list)
    without_regex: str = ""

    def takes(self, topic: str, kind: str) -> bool:
        """Whether a topic with this name and type is recorded."""
        listed = self.every or topic in self.topics or kind in self.types
        if not listed and not (self.regex and re.search(self.regex, topic)):
            return False
        if kind in self.without_types or topic in self.without_topics:
            return False
        return not (self.without_regex and re.search(self.without_regex, topic))


class Recording:
    """A recording. A signal ends it between two messages, so that the bag is always complete."""

    def __init__(
        self,
        folder: Path,
        choice: Choice,
        *,
        compress: bool,
        custom_data: Mapping[str, str],
        name: str,
        poll: float | None,
        use_sim_time: bool,
    ) -> None:
        """`poll` is the time between two checks of the graph [s]; None means a single check.

        Raises:
            CliError: the folder cannot be made.
        """
        self._choice, self._poll, self._name = choice, poll, name
        self._use_sim_time, self._ended = use_sim_time, False
        self._known: set[str] = set()
        self._warned: set[str] = set()
        self._recorded: set[str] = set()
        try:
            self._writer = BagWriter(folder, compress=compress, custom_data=custom_data)
        except (OSError, WriterError) as error:
            raise CliError(f"Failed to create bag directory ({folder}): {error}") from error

    def run(self) -> None:
        """Records until SIGINT or SIGTERM."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._end)
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        try:
            self._record()
        finally:
            self._writer.close()
            rclpy.try_shutdown()

    def _end(self, number: int, frame: Any) -> None:
        self._ended = True

    def _record(self) -> None:
        clock = Parameter("use_sim_time", value=self._use_sim_time)
        self._node = Node(self._name, start_parameter_services=False, parameter_overrides=[clock])
        log = self._node.get_logger()
        log.info("Listening for topics...")
        if self._poll is None:
            settle(self._node, lambda: self._ended)
        self._look_around()
        log.info("Recording...")
        due = time.monotonic()
        while not self._ended:
            rclpy.spin_once(self._node, timeout_sec=min(self._poll or _BREATH, _BREATH))
            if self._poll is not None and time.monotonic() >= due + self._poll:
                due = time.monotonic()
                self._look_around()
        log.info("Recording stopped")

    def _look_around(self) -> None:
        if not self._stamp():
            return  # no simulated time has been received
        for topic, kinds in self._node.get_topic_names_and_types():
            if topic in self._known or not self._choice.takes(topic, kinds[0]):
                continue
            if is_hidden(topic) and not self._choice.hidden:
                self._known.add(topic)
                self._warn(
                    "Hidden topics are not recorded. Enable them with --include-hidden-topics"
                )
                continue
            publishers = self._node.get_publishers_info_by_topic(topic)
            if not publishers and not self._choice.unpublished:
                continue
            if not self._choice.unheard and not self._node.count_subscribers(topic):
                continue
            self._known.add(topic)
            if len(kinds) > 1:
                self._warn(f"Topic '{topic}' has more than one type associated. Only topics with "
                           "one type are supported")  # fmt: skip
                continue
            self._subscribe(topic, kinds[0], [end.qos_profile for end in publishers])
        if self._poll is not None and self._recorded and self._recorded == set(self._choice.topics):
            self._node.get_logger().info(
                "All requested topics are subscribed. Stopping discovery..."
            )
            self._poll = None

    def _warn(self, text: str) -> None:
        if text not in self._warned:
            self._warned.add(text)
            get_logger("ROSBAG2_TRANSPORT").warning(text)

    def _subscribe(self, topic: str, kind: str, offers: list[QoSProfile]) -> None:
        try:
            message_class = interface_class(kind)
        except InterfaceError as error:
            self._warn(f"Topic '{topic}' has unknown type '{kind}' . Only topics with known type "
                       f"are supported. Reason: '{error}'")  # fmt: skip
            return
        self._recorded.add(topic)
        connection = self._writer.add_topic(topic, kind, offers)
        write = partial(self._write, connection)
        self._node.create_subscription(message_class, topic, write, request_for(offers), raw=True)
        self._node.get_logger().info(f"Subscribed to topic '{topic}'")

    def _write(self, connection: Connection, data: bytes) -> None:
        if stamp := self._stamp():
            self._writer.write(connection, stamp, data)

    def _stamp(self) -> int:
        """The time [ns]; 0 until simulated time has been received."""
        return self._node.get_clock().now().nanoseconds


def request_for(offers: list[QoSProfile]) -> QoSProfile:
    """The strictest quality of service that all publishers offer."""
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        depth=_QUEUE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL
        if latched and offers
        else DurabilityPolicy.VOLATILE,
    )
