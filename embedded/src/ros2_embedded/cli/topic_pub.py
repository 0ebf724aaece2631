"""`ros2 topic pub`."""

from __future__ import annotations

import argparse
import time
from typing import Any

import rclpy
import yaml
from rclpy.node import Node

from ros2_embedded.cli import topic_qos
from ros2_embedded.cli.command_node import add_direct_options, await_peer, command_node
from ros2_embedded.cli.common import (
    exclusive,
    flag,
    given_values,
    option,
    positive_float,
    values_options,
    whole,
)
from ros2_embedded.cli.topic_type import message_type
from ros2_embedded.message_values import fill

_POLL = 0.1
_POLLS_PER_LINE = 10


def nonnegative_int(text: str) -> int:
    """Argument of a command line: argparse names this function in its error."""
    number = whole(text)
    if number < 0:
        raise ValueError
    return number


OPTIONS = (
    option("topic_name", help="Name of the ROS topic to publish to (e.g. '/chatter')"),
    option("message_type", help="Type of the ROS message (e.g. 'std_msgs/String')"),
    values_options("values", "Values to fill the message with in YAML format (e.g. 'data: Hello "
                   "World'), otherwise the message will be published with default values"),
    option("-r", "--rate", metavar="N", type=positive_float, default=1.0,
           help="Publishing rate in Hz (default: 1)"),
    option("-p", "--print", metavar="N", type=whole, default=1,
           help="Only print every N-th published message (default: 1)"),
    exclusive(
        flag("-1", "--once", text="Publish one message and exit"),
        option("-t", "--times", type=nonnegative_int, default=0,
               help="Publish this number of times and then exit"),
    ),
    option("-w", "--wait-matching-subscriptions", type=nonnegative_int,
           help="Wait until finding the specified number of matching subscriptions. Defaults to 1 "
           'when using "-1"/"--once"/"--times", otherwise defaults to 0.'),
    option("--max-wait-time-secs", type=positive_float,
           help="This sets the maximum wait time in seconds if --wait-until-matching-subscriptions "
           "is set. By default, this flag is not set meaning the subscriber will wait endlessly."),
    option("--keep-alive", metavar="N", type=positive_float, default=0.1,
           help="Keep publishing node alive for N seconds after the last msg (default: 0.1)"),
    option("-n", "--node-name", help="Name of the created publishing node"),
    *topic_qos.options("publish", "default"),
    add_direct_options,
)  # fmt: skip


def publish(options: argparse.Namespace) -> str | None:
    """Publishes once, a number of times, or until Ctrl-C; returns what went wrong."""
    text = given_values(options, "values")
    with command_node(options, lambda node: True, options.node_name) as node:
        kind = message_type(options.message_type)
        values = yaml.safe_load(text)
        if not isinstance(values, dict):
            return "The passed value needs to be a dictionary in YAML format"
        publisher = node.create_publisher(kind, options.topic_name, topic_qos.profile(options))
        times = 1 if options.once else options.times
        problem = _await_subscriptions(publisher, options, int(times != 0))
        if problem is not None:
            return problem
        message = kind()
        try:
            stamps = fill(message, values, expand=True)
        except Exception as error:  # whatever a value does to a field, as in ROS 2
            return f"Failed to populate field: {error}"
        _publish(node, publisher, message, stamps, times, options)
        time.sleep(options.keep_alive)
    return None


def _await_subscriptions(
    publisher: Any, options: argparse.Namespace, default: int
) -> str | None:  # fmt: skip
    """Waits for subscriptions; returns what is wrong if they do not come in time."""
    given, limit = options.wait_matching_subscriptions, options.max_wait_time_secs
    wanted = default if given is None else given
    if wanted == 0 and limit is not None:
        return (
            "--max-wait-time-secs option is only effective with --wait-matching-subscriptions, "
            "--once or --times"
        )
    polls = 0
    while (found := publisher.get_subscription_count()) < wanted:
        if polls % _POLLS_PER_LINE == 0:
            print(f"Waiting for at least {wanted} matching subscription(s)...")
        if limit is not None and limit <= polls * _POLL:
            return (
                f"Timed out waiting for subscribers: Expected {wanted} subcribers but only got "
                f"{found} subscribers"
            )
        polls += 1
        await_peer(rclpy.ok)
        time.sleep(_POLL)
    return None


def _publish(
    node: Node,
    publisher: Any,
    message: Any,
    stamps: list[Any],
    times: int,
    options: argparse.Namespace,
) -> None:
    print("publisher: beginning loop")
    count = 0

    def send() -> None:
        nonlocal count
        now = node.get_clock().now().to_msg()
        for set_stamp in stamps:
            set_stamp(now)
        count += 1
        if options.print and count % options.print == 0:
            print(f"publishing #{count}: {message!r}\n")
        publisher.publish(message)

    send()
    if times != 1:
        node.create_timer(1.0 / options.rate, send)
        while times == 0 or count < times:
            rclpy.spin_once(node)
