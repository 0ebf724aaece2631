"""Node ``recorder``: write every topic of the graph into one MCAP file."""

import re
import struct
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import rclpy
from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from door_impact_common.errors import InputError, OutputError, SettingError
from door_impact_common.node import GuardedNode, executor_of, run_node, spin_for
from door_impact_common.parameters import Parameters
from mcap.writer import Writer
from rclpy.clock import Clock, ClockType
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
from robot_driver.intake import present

_PART = re.compile(r"^\s*(?:(\w+)/)?([A-Z]\w*)[ \t\[]", re.MULTILINE)  # a field that is a message


def definition(name: str) -> str:
    """Return the definition of a message and of the messages in it, from the installed packages.

    Args:
        name: Type of the message, ``package/msg/Name``.

    Raises:
        InputError: No file defines it, or a message in it.
    """
    found: dict[str, str] = {}
    wanted = [name]
    while wanted:
        package, kind, short = wanted.pop().split("/")
        try:
            path = Path(get_package_share_directory(package), kind, f"{short}.msg")
            text = path.read_text("utf-8")
        except (PackageNotFoundError, OSError) as error:
            raise InputError(name, f"no definition of {package}/{kind}/{short}") from error
        found[f"{package}/{short}"] = text
        parts = {(other or package, part) for other, part in _PART.findall(text)}
        wanted += [f"{other}/msg/{part}" for other, part in sorted(parts)
                   if f"{other}/{part}" not in found]
    first, *others = found.items()
    return first[1] + "".join(f"\n{'=' * 80}\nMSG: {part}\n{text}" for part, text in others)


POLL = 0.1    # time between two searches for new topics [s]
FLUSH = 1.0   # longest time for which a message is not yet in the file [s]
QUEUE = 1000  # messages of a topic that may wait to be written: 5 s at 200 Hz
_STAMP, _STAMP_AT = struct.Struct("<iI"), 4  # seconds and nanoseconds behind CDR's header
_PARAMETERS = {"file": ("", "MCAP file to write")}
_INFINITE = "{sec: 9223372036, nsec: 854775807}"
# As rosbag2 notes it. No node of this project sets deadline, lifespan or lease.
_OFFER = f"""\
- {{history: %s, depth: %d, reliability: %s, durability: %s, deadline: {_INFINITE},
   lifespan: {_INFINITE}, liveliness: %s, liveliness_lease_duration: {_INFINITE},
   avoid_ros_namespace_conventions: false}}
"""


class Recorder(GuardedNode):
    """Subscribes to every topic that has a publisher, and writes the messages as they arrive.

    The messages of a second are a chunk of the file. A file that lacks its end, because the node
    was killed or the disk became full, can be read up to its last chunk.

    Raises:
        SettingError: The parameter `file` is not the name of an MCAP file.
    """

    def __init__(self) -> None:
        super().__init__("recorder")
        name = Parameters(self, _PARAMETERS).text("file")
        self._path = Path(name)
        if self._path.suffix != ".mcap":
            raise SettingError("file", name, "the MCAP file to write: -p file:=run.mcap")
        self._known: set[str] = set()
        self._torn: set[str] = set()  # topics of which users were warned
        self._now = 0.0  # present time [s]
        self._pending = 0  # number of messages that are not yet in the file
        self._error: OSError | None = None  # after it nothing can be recorded

    def run(self) -> None:
        """Record until the node is stopped, or the disk is full.

        Raises:
            OutputError: The file exists or cannot be written.
        """
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = self._path.open("xb")
        except OSError as error:
            raise OutputError(f"{self._path}: cannot be written: {error.strerror}") from error
        self._writer = Writer(self._stream, chunk_size=2**62)  # `_flush` alone ends a chunk
        self._try(partial(self._writer.start, "ros2"))
        self.get_logger().info(f"recording to {self._path}")
        # The timers use the steady clock: simulated time may stand still.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(POLL, self._search, clock=steady)
        self.create_timer(FLUSH, partial(self._try, self._flush), clock=steady)
        try:
            with executor_of(self) as executor:
                while rclpy.ok() and self._error is None:
                    spin_for(executor, POLL)
        finally:
            self._close()

    def _try(self, work: Callable[[], Any]) -> None:
        """Write, unless writing has failed before."""
        if self._error is None:
            try:
                work()
            except OSError as error:
                self._error = error

    def _flush(self) -> None:
        self._writer.flush()
        self._pending = 0

    def _close(self) -> None:
        """Complete the file.

        Raises:
            OutputError: Not all messages could be written.
        """
        for work in (self._flush, self._writer.finish, self._stream.close):
            self._try(work)
        if self._error is not None:
            self._stream.raw.close()  # without what waits in the stream's buffer
            raise OutputError(f"{self._path}: cannot be written: {self._error.strerror}; the file "
                              f"has no index, and its last {self._pending} messages may be missing")

    def _search(self) -> None:
        """Start to record topics that are new in the graph."""
        if not self.get_clock().now().nanoseconds:
            return  # simulated time has not begun, so no message could be stamped
        for topic, kinds in self.get_topic_names_and_types():
            if len(kinds) > 1 and topic in self._known - self._torn:
                self._torn.add(topic)
                self.get_logger().warning(
                    f"{topic} now has several types, {', '.join(kinds)}: the first one is recorded")
            if topic in self._known or topic_or_service_is_hidden(topic):
                continue
            publishers = self.get_publishers_info_by_topic(topic)
            if publishers:  # before the first publisher, the quality of service is unknown
                self._known.add(topic)
                try:
                    self._record(topic, kinds, publishers)
                except InputError as error:
                    self._torn.add(topic)
                    self.get_logger().warning(f"{topic} is not recorded: {error}")

    def _record(self, topic: str, kinds: Sequence[str], ends: Sequence[TopicEndpointInfo]) -> None:
        """Start to record a topic.

        Raises:
            InputError: The topic has several types, or its type is not installed.
        """
        if len(kinds) != 1:
            raise InputError(topic, f"has several types, {', '.join(kinds)}")
        text = definition(kinds[0]).encode()
        package, kind, short = kinds[0].split("/")
        try:
            message_class = getattr(import_module(f"{package}.{kind}"), short)
        except (ImportError, AttributeError) as error:
            raise InputError(kinds[0], f"its Python module is missing ({error})") from error
        offers = [end.qos_profile for end in ends]
        schema = self._writer.register_schema(kinds[0], "ros2msg", text)
        channel = self._writer.register_channel(topic, "cdr", schema, {
            "offered_qos_profiles": "".join(map(_noted, offers)),
            "topic_type_hash": str(ends[0].topic_type_hash)})
        first = next(iter(message_class.get_fields_and_field_types().values()), "")
        stamped = first in ("std_msgs/Header", "builtin_interfaces/Time")
        write = partial(self._write, channel, stamped)
        self.create_subscription(message_class, topic, write, request_for(offers), raw=True)

    def _write(self, channel: int, stamped: bool, data: bytes) -> None:
        stamps = [self._now]
        if stamped:
            seconds, rest = _STAMP.unpack_from(data, _STAMP_AT)
            stamps.append(seconds + 1e-9 * rest)
        self._now = present(1e-9 * self.get_clock().now().nanoseconds, *stamps)
        received = round(1e9 * self._now)
        self._pending += 1
        self._try(partial(self._writer.add_message, channel, received, data, received))


def request_for(offers: Sequence[QoSProfile]) -> QoSProfile:
    """Choose the strongest quality of service that all publishers of a topic can serve.

    Args:
        offers: Quality of service of each publisher.
    """
    reliable = all(offer.reliability != ReliabilityPolicy.BEST_EFFORT for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        depth=QUEUE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


def _noted(offer: QoSProfile) -> str:
    """Return an offer as rosbag2 notes it in YAML."""
    policies = (offer.reliability, offer.durability, offer.liveliness)
    names = (policy.name.lower() for policy in policies)
    return _OFFER % (offer.history.name.lower(), offer.depth, *names)


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped; the exit code is 1 if it cannot run."""
    return run_node(Recorder, args=args, spin=Recorder.run)


if __name__ == "__main__":
    sys.exit(main())
