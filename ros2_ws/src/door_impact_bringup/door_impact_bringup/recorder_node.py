"""Node ``recorder``: writes every topic of the graph into one MCAP file."""

import struct
import sys
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import rclpy
from door_impact_common.errors import SettingError
from door_impact_common.node import GuardedNode, executor_of, run_node, spin_for
from door_impact_common.parameters import Parameters
from rclpy.clock import Clock, ClockType
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from door_impact_bringup.errors import DefinitionError, McapWriteError
from door_impact_bringup.mcap_file import McapFile, partial_folder
from door_impact_bringup.message_definitions import MessageDefinitions

POLL = 0.1    # time between two searches for new topics [s]
QUEUE = 1000  # messages of a topic that may wait to be written: 5 s at 200 Hz
_STAMP, _STAMP_AT = struct.Struct("<iI"), 4  # seconds and nanoseconds behind CDR's header
_AHEAD = 20_000_000  # time between two messages on a simulation's /clock [ns]
_INFINITE = QosTime(9223372036, 854775807)
_PARAMETERS = {"file": ("", "MCAP file to write")}


class Recorder(GuardedNode):
    """Subscribes to every topic that has a publisher, and writes the messages as they arrive.

    Raises:
        SettingError: The parameter `file` is empty.
    """

    def __init__(self) -> None:
        super().__init__("recorder")
        name = Parameters(self, _PARAMETERS).text("file")
        if not name:
            raise SettingError("file", name, "the MCAP file to write: -p file:=run.mcap")
        self._path = Path(name)
        self._definitions = MessageDefinitions()
        self._known: set[str] = set()
        self._error: McapWriteError | None = None  # after it nothing can be recorded

    def run(self) -> None:
        """Records until the node is stopped, or the disk is full; then the file is complete.

        Raises:
            SettingError: The name of the file does not end in ``.mcap``.
            McapWriteError: The file exists or cannot be written.
        """
        self._file = McapFile(self._path)
        self.get_logger().info(f"recording to {self._path}")
        # The timer uses the steady clock: simulated time may stand still.
        self.create_timer(POLL, self._search, clock=Clock(clock_type=ClockType.STEADY_TIME))
        try:
            with executor_of(self) as executor:
                while rclpy.ok() and self._error is None:
                    spin_for(executor, POLL)
        finally:
            self._close()
        if self._error is not None:
            raise self._error

    def _close(self) -> None:
        """Completes the file; says what is missing, also after a signal."""
        try:
            lost = self._file.close()
        except McapWriteError as error:
            print(f"{self.get_name()}: {error}; its parts are in {partial_folder(self._path)}",
                  file=sys.stderr)
            return
        if lost:
            print(f"{self.get_name()}: {self._path} is complete but for its last {lost} messages, "
                  "for which there was no room", file=sys.stderr)

    def _search(self) -> None:
        """Starts to record topics that are new in the graph."""
        if not self.get_clock().now().nanoseconds:
            return  # simulated time has not begun, so no message could be stamped
        for topic, kinds in self.get_topic_names_and_types():
            if topic in self._known or _is_hidden(topic):
                continue
            publishers = self.get_publishers_info_by_topic(topic)
            if publishers:  # before the first publisher, the quality of service is unknown
                self._known.add(topic)
                self._record(topic, kinds, [end.qos_profile for end in publishers])

    def _record(self, topic: str, kinds: Sequence[str], offers: Sequence[QoSProfile]) -> None:
        try:
            if len(kinds) != 1:
                raise DefinitionError(topic, f"it has several types, {', '.join(kinds)}")
            message_class = _message_class(kinds[0])
            self._definitions.require(kinds[0])
        except DefinitionError as error:
            self.get_logger().warning(f"{topic} is not recorded: {error}")
            return
        offered = [_recorded(offer) for offer in offers]
        connection = self._file.add_topic(topic, kinds[0], self._definitions.store, offered)
        first = next(iter(message_class.get_fields_and_field_types().values()), "")
        stamped = first in ("std_msgs/Header", "builtin_interfaces/Time")
        write = partial(self._write, connection, stamped)
        self.create_subscription(message_class, topic, write, request_for(offers), raw=True)

    def _write(self, connection: Connection, stamped: bool, data: bytes) -> None:
        now = self.get_clock().now().nanoseconds
        if stamped:  # between two messages on /clock the stamps tell the time
            seconds, rest = _STAMP.unpack_from(data, _STAMP_AT)
            stamp = 1_000_000_000 * seconds + rest
            now = stamp if now < stamp < now + _AHEAD else now
        try:
            self._file.write(connection, now, data)
        except McapWriteError as error:
            self._error = error


def request_for(offers: Sequence[QoSProfile]) -> QoSProfile:
    """Chooses the strongest quality of service that all publishers of a topic can serve.

    Args:
        offers: Quality of service of each publisher.
    """
    reliable = all(offer.reliability != ReliabilityPolicy.BEST_EFFORT for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        depth=QUEUE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


def _recorded(offer: QoSProfile) -> Qos:
    """Converts an offer for the file; deadline, lifespan and lease are written as infinite.

    No node of this project sets these three.
    """
    return Qos(
        QosHistory[offer.history.name], offer.depth, QosReliability[offer.reliability.name],
        QosDurability[offer.durability.name], _INFINITE, _INFINITE,
        QosLiveliness[offer.liveliness.name], _INFINITE, avoid_ros_namespace_conventions=False)


def _is_hidden(topic: str) -> bool:
    return any(part.startswith("_") for part in topic.split("/"))


def _message_class(name: str) -> Any:
    package, kind, short = name.split("/")
    try:
        return getattr(import_module(f"{package}.{kind}"), short)
    except (ImportError, AttributeError) as error:
        raise DefinitionError(name, f"its Python module is missing ({error})") from error


def main(args: list[str] | None = None) -> int:
    """Runs the node until it is stopped.

    Args:
        args: Command line; None means the process's own.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 if the node cannot run.
    """
    return run_node(Recorder, args=args, spin=Recorder.run)


if __name__ == "__main__":
    sys.exit(main())
