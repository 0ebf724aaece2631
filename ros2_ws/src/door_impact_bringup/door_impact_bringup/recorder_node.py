"""Node ``recorder``: every topic of the graph in one MCAP file, as `ros2 bag record -a` does."""

import sys
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import rclpy
from door_impact_common.errors import SettingError
from door_impact_common.node import run_node
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
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

from door_impact_bringup.mcap_file import McapFile
from door_impact_bringup.message_definitions import DefinitionError, MessageDefinitions

POLL = 0.1    # between two looks at the graph [s]
QUEUE = 1000  # messages of a topic that may wait: 5 s at 200 Hz
_INFINITE = QosTime(9223372036, 854775807)


class Recorder(Node):
    """Subscribes to whatever appears, and writes the bytes as they come."""

    def __init__(self) -> None:
        super().__init__("recorder")
        described = ParameterDescriptor(description="MCAP file to write", read_only=True)
        name = self.declare_parameter("file", "", described).value
        if not name:
            raise SettingError("file", name, "the MCAP file to write: -p file:=run.mcap")
        self._path = Path(name)
        self._definitions = MessageDefinitions()
        self._known: set[str] = set()

    def run(self) -> None:
        """Records until the node is told to end; then the file is complete.

        Raises:
            RecordingError: The file exists or cannot be written.
        """
        self._file = McapFile(self._path)
        self.get_logger().info(f"recording to {self._path}")
        # On the steady clock: simulated time may stand still.
        self.create_timer(POLL, self._look_around, clock=Clock(clock_type=ClockType.STEADY_TIME))
        try:
            rclpy.spin(self)
        finally:
            self._file.close()

    def _look_around(self) -> None:
        if not self.get_clock().now().nanoseconds:
            return  # simulated time has not begun: nothing could be stamped
        for topic, kinds in self.get_topic_names_and_types():
            if topic in self._known or _is_hidden(topic):
                continue
            ends = self.get_publishers_info_by_topic(topic)
            if ends:  # without a publisher nobody knows what will be offered
                self._known.add(topic)
                self._record(topic, kinds, [end.qos_profile for end in ends])

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
        write = partial(self._write, connection)
        self.create_subscription(message_class, topic, write, request_for(offers), raw=True)

    def _write(self, connection: Connection, data: bytes) -> None:
        self._file.write(connection, self.get_clock().now().nanoseconds, data)


def request_for(offers: Sequence[QoSProfile]) -> QoSProfile:
    """The strongest quality of service that every one of the offers meets."""
    reliable = all(offer.reliability != ReliabilityPolicy.BEST_EFFORT for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        depth=QUEUE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


def _recorded(offer: QoSProfile) -> Qos:
    """An offer as the file has it; deadlines and lifespans, which nobody here sets, as infinite."""
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
    """Run the node until it is told to end."""
    return run_node(Recorder, args=args, spin=Recorder.run)


if __name__ == "__main__":
    sys.exit(main())
