"""`ros2 topic pub`."""

from __future__ import annotations

import argparse
import time

import rclpy
from rclpy.qos import QoSProfile

from ros2_embedded.cli import topic_qos
from ros2_embedded.cli.common import CliError, command_node, filled, interface

_MATCH_WAIT = 1.0
_KEEP_ALIVE = 0.1


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options."""
    parser.add_argument("topic_name")
    parser.add_argument("message_type")
    parser.add_argument("values", nargs="?", help="fields in YAML")
    parser.add_argument("-r", "--rate", type=float, default=1.0, metavar="HZ")
    parser.add_argument("-1", "--once", action="store_true", help="publish one message and end")
    parser.add_argument(
        "-t", "--times", type=int, default=0, metavar="N", help="publish this often"
    )
    parser.add_argument("-w", "--wait-matching-subscriptions", type=int, metavar="N",
                        help="wait until so many subscriptions are there")  # fmt: skip
    topic_qos.define(parser)


def publish(options: argparse.Namespace) -> int:
    """Publish a message to a topic."""
    if options.rate <= 0:
        raise CliError(f"--rate must be positive, not {options.rate}")
    message = filled(interface(options.message_type, "msg"), options.values)
    times = 1 if options.once else options.times
    with command_node() as node:
        qos: QoSProfile = topic_qos.profile(options, [])
        publisher = node.create_publisher(type(message), options.topic_name, qos)
        wanted = options.wait_matching_subscriptions
        patience = time.monotonic() + _MATCH_WAIT
        while publisher.get_subscription_count() < (1 if wanted is None and times else wanted or 0):
            if not rclpy.ok() or (wanted is None and time.monotonic() > patience):
                break
            time.sleep(0.02)
        print("publisher: beginning loop", flush=True)
        count, due = 0, time.monotonic()
        while rclpy.ok():
            message = filled(type(message), options.values)
            publisher.publish(message)
            count += 1
            print(f"publishing #{count}: {message!r}\n", flush=True)
            if count == times:
                break
            due += 1.0 / options.rate
            time.sleep(max(0.0, due - time.monotonic()))
        time.sleep(_KEEP_ALIVE)
    return 0
