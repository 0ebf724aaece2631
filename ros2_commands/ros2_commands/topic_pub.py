"""`ros2 topic pub`."""

from __future__ import annotations

import argparse
import time
from itertools import count as numbers
from typing import Any

from rclpy.duration import Duration

from ros2_commands.graph import bare_node
from ros2_commands.interface_classes import interface_class
from ros2_commands.message_values import message_from_yaml
from ros2_commands.options import count, positive
from ros2_commands.qos import add_qos, profile

_POLL = 0.1  # [s]
_DELIVERY = 2.0  # longest wait until the last message has arrived [s]


def define(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("topic_name")
    parser.add_argument("message_type")
    parser.add_argument("values", nargs="?", default="{}", help="message in YAML: '{data: 1.0}'")
    parser.add_argument("-r", "--rate", type=positive, default=1.0, metavar="N", help="in Hz")
    times = parser.add_mutually_exclusive_group()
    times.add_argument("-1", "--once", dest="times", action="store_const", const=1, default=0)
    times.add_argument("-t", "--times", type=count, default=0, metavar="N",
                       help="end after N messages")  # fmt: skip
    parser.add_argument("-w", "--wait-matching-subscriptions", dest="wait", type=count, metavar="N",
                        help="first wait for N subscriptions (with -1 or -t: 1)")  # fmt: skip
    add_qos(parser, "default")


def publish(options: argparse.Namespace) -> None:
    """Publish a message once, N times, or until Ctrl-C."""
    kind = interface_class(options.message_type, "msg")
    message = message_from_yaml(kind, options.values)
    with bare_node() as node:
        publisher = node.create_publisher(kind, options.topic_name, profile(options))
        _await(publisher, int(options.times > 0) if options.wait is None else options.wait)
        print("publisher: beginning loop")
        start = time.monotonic()
        for number in numbers(1):
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
