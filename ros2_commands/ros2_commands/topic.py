"""`ros2 topic`: list, info, type, echo, hz and pub."""

from __future__ import annotations

import argparse
import statistics
import time
from collections import deque
from itertools import count as numbers
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data

from ros2_commands.errors import CommandError
from ros2_commands.graph import Named, add_list, add_type, bare_node, graph_node, spin
from ros2_commands.messages import (
    interface_class,
    is_message,
    message_from_yaml,
    to_csv,
    to_yaml,
)
from ros2_commands.options import Verbs, add_discovery, count, positive
from ros2_commands.qos import add_qos, matching_profile, profile

_POLL = 0.1  # [s]
_DELIVERY = 2.0  # longest wait until the last message has arrived [s]


def _topics(node: Node) -> Named:
    return list(node.get_topic_names_and_types())


def _ends(node: Node, topics: Named) -> str:
    """Return how many publish and how many subscribe to each topic."""
    lines = []
    for title, end, count_of in (("Published", "publisher", node.count_publishers),
                                 ("Subscribed", "subscriber", node.count_subscribers)):
        lines += [f"{title} topics:", *(
            f" * {name} [{', '.join(types)}] {number} {end}{'s' * (number > 1)}"
            for name, types in topics if (number := count_of(name))), ""]
    return "\n".join(lines)


def _info(options: argparse.Namespace) -> None:
    """Print a topic's type and who publishes and subscribes to it."""
    name = options.topic_name
    with graph_node(options.spin_time) as node:
        types = dict(node.get_topic_names_and_types()).get(name)
        if types is None:
            raise CommandError(f"Unknown topic '{name}'")
        sides = {
            "Publisher": node.get_publishers_info_by_topic(name),
            "Subscription": node.get_subscriptions_info_by_topic(name),
        }
    end = "\n\n" if options.verbose else "\n"
    print(f"Type: {types[0] if len(types) == 1 else types}", end=end)
    for title, ends in sides.items():
        print(f"{title} count: {len(ends)}", end=end)
        for each in ends if options.verbose else ():
            print(each, end=end)


def _class(node: Node, topic: str) -> Any:
    """Return the class of the messages on a topic.

    Raises:
        CommandError: Nobody uses the topic, or it has several types or an unknown one.
    """
    name = node.resolve_topic_name(topic)
    types = dict(node.get_topic_names_and_types()).get(name, [])
    if not types:
        raise CommandError(f"WARNING: topic [{topic}] does not appear to be published yet\n"
                           "Could not determine the type for the passed topic")  # fmt: skip
    if len(types) > 1:
        raise CommandError(f"Topic '{topic}' has more than one type: [{', '.join(types)}]")
    return interface_class(types[0], "msg")


def _part(message: Any, field: str | None) -> Any:
    value = message
    for name in field.split(".") if field else ():
        if not (is_message(value) and name in value.get_fields_and_field_types()):
            raise CommandError(f"Invalid field '{field}': no '{name}' in {type(value).__name__}")
        value = getattr(value, name)
    return value


def _text(value: Any, options: argparse.Namespace) -> str:
    longest = None if options.full_length else options.truncate_length
    if options.csv:
        return to_csv(value, longest)
    body = to_yaml(value, longest, options.flow_style) if is_message(value) else f"{value}\n"
    return f"{body}---"


def _echo(options: argparse.Namespace) -> None:
    """Print the messages of a topic until Ctrl-C."""
    seen: list[bool] = []

    def show(message: Any) -> None:
        if not (options.once and seen):
            print(_text(_part(message, options.field), options))
            seen.append(True)

    name = options.topic_name
    with graph_node(options.spin_time, lambda node: node.count_publishers(name)) as node:
        kind = options.message_type
        found = interface_class(kind, "msg") if kind else _class(node, name)
        chosen = matching_profile(options, node.get_publishers_info_by_topic(name))
        node.create_subscription(found, name, show, chosen)
        spin(node, lambda: options.once and seen)


class Rate:
    """The rate of messages by their arrival times in [s]; `window` is how many gaps count."""

    def __init__(self, window: int) -> None:
        self._gaps: deque[float] = deque(maxlen=window)
        self._last: float | None = None
        self._reported = 0.0

    def add(self, now: float) -> str | None:
        """Count a message; at most once a second, return a report."""
        if self._last is None:
            self._last = self._reported = now
            return None
        self._gaps.append(now - self._last)
        self._last = now
        if now < self._reported + 1.0:
            return None
        self._reported = now
        return (
            f"average rate: {1.0 / statistics.fmean(self._gaps):.3f}\n"
            f"\tmin: {min(self._gaps):.3f}s max: {max(self._gaps):.3f}s "
            f"std dev: {statistics.pstdev(self._gaps):.5f}s window: {len(self._gaps)}"
        )


def _rate(options: argparse.Namespace) -> None:
    """Print the rate of a topic's messages, in wall time, until Ctrl-C."""
    measured = Rate(options.window)

    def note(_: Any) -> None:
        if report := measured.add(time.monotonic()):
            print(report)

    name = options.topic_name
    with graph_node(options.spin_time, lambda node: node.count_publishers(name)) as node:
        if not node.count_publishers(name):
            print(f"WARNING: topic [{name}] does not appear to be published yet")
        while not node.count_publishers(name):
            time.sleep(_POLL)
        kind = _class(node, name)
        node.create_subscription(kind, name, note, qos_profile_sensor_data, raw=True)
        spin(node)


def _publish(options: argparse.Namespace) -> None:
    """Publish a message once, N times, or until Ctrl-C."""
    kind = interface_class(options.message_type, "msg")
    message_from_yaml(kind, options.values)  # what is wrong is said before anybody is waited for
    with bare_node() as node:
        publisher = node.create_publisher(kind, options.topic_name, profile(options))
        _await(publisher, int(options.times > 0) if options.wait is None else options.wait)
        print("publisher: beginning loop")
        start = time.monotonic()
        for number in numbers(1):
            message = message_from_yaml(kind, options.values)  # anew: a stamp may be `now`
            print(f"publishing #{number}: {message!r}\n")
            publisher.publish(message)
            if number == options.times:
                break
            time.sleep(max(0.0, start + number / options.rate - time.monotonic()))
        publisher.wait_for_all_acked(Duration(seconds=_DELIVERY))


def _await(publisher: Any, wanted: int) -> None:
    for poll in numbers():
        if publisher.get_subscription_count() >= wanted:
            return
        if poll % 10 == 0:
            print(f"Waiting for at least {wanted} matching subscription(s)...")
        time.sleep(_POLL)


def _define_echo(verb: argparse.ArgumentParser) -> None:
    add_discovery(verb)
    verb.add_argument("topic_name")
    verb.add_argument("message_type", nargs="?", help="by default the publishers'")
    add_qos(verb, "sensor_data")
    verb.add_argument("--once", action="store_true", help="end after the first message")
    verb.add_argument("--field", help="print only a part, as header.stamp")
    verb.add_argument("--csv", action="store_true", help="print a line of all fields")
    verb.add_argument("--flow-style", action="store_true", help="print each list in one line")
    verb.add_argument("-f", "--full-length", action="store_true", help="cut nothing")
    verb.add_argument("-l", "--truncate-length", type=count, default=128, metavar="N",
                        help="cut lists and strings after N elements")  # fmt: skip


def _define_hz(verb: argparse.ArgumentParser) -> None:
    add_discovery(verb)
    verb.add_argument("topic_name")
    verb.add_argument("-w", "--window", type=count, default=10000, metavar="N",
                        help="number of messages that the mean is taken of")  # fmt: skip


def _define_pub(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("topic_name")
    verb.add_argument("message_type")
    verb.add_argument("values", nargs="?", default="{}", help="message in YAML: '{data: 1.0}'")
    verb.add_argument("-r", "--rate", type=positive, default=1.0, metavar="N", help="in Hz")
    times = verb.add_mutually_exclusive_group()
    times.add_argument("-1", "--once", dest="times", action="store_const", const=1, default=0)
    times.add_argument("-t", "--times", type=count, default=0, metavar="N",
                       help="end after N messages")  # fmt: skip
    verb.add_argument("-w", "--wait-matching-subscriptions", dest="wait", type=count, metavar="N",
                        help="first wait for N subscriptions (with -1 or -t: 1)")  # fmt: skip
    add_qos(verb, "default")


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs to the command's parser."""
    verbs = Verbs(parser)
    add_list(verbs, "topics", _topics, _ends)
    add_type(verbs, "topic", _topics)
    info = verbs.add("info", _info)
    add_discovery(info)
    info.add_argument("topic_name")
    info.add_argument("-v", "--verbose", action="store_true",
                      help="show node, type hash, GID and QoS of each end")  # fmt: skip
    _define_echo(verbs.add("echo", _echo))
    _define_hz(verbs.add("hz", _rate))
    _define_pub(verbs.add("pub", _publish))
