"""`ros2 topic delay`."""

from __future__ import annotations

import argparse
import statistics
from collections import deque
from typing import Any

import rclpy
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time

from ros2_embedded.cli.command_node import add_direct_options, command_node
from ros2_embedded.cli.common import CliError, option, window_option
from ros2_embedded.cli.topic_type import type_of_topic

OPTIONS = (
    option("topic", help="Topic name to calculate the delay for"),
    window_option(10000, "window size, in # of messages, for calculating rate, string to"),
    add_direct_options,
)


def report(delays: list[int]) -> str:
    """Delays [ns] as text."""
    mean, deviation = sum(delays) / len(delays), statistics.pstdev(delays)
    return (
        f"average delay: {mean * 1e-9:.3f}\n"
        f"\tmin: {min(delays) * 1e-9:.3f}s max: {max(delays) * 1e-9:.3f}s "
        f"std dev: {deviation * 1e-9:.5f}s window: {len(delays)}"
    )


def delay(options: argparse.Namespace) -> None:
    """Prints the age of the messages' stamps until Ctrl-C."""
    delays: deque[int] = deque(maxlen=options.window)
    fresh: list[bool] = []
    with command_node(options, lambda node: node.count_publishers(options.topic)) as node:

        def note(message: Any) -> None:
            if not hasattr(message, "header"):
                raise CliError("msg does not have header")
            now = node.get_clock().now()
            if now.nanoseconds:
                delays.append((now - Time.from_msg(message.header.stamp)).nanoseconds)
                fresh[:] = [True]

        def show() -> None:
            if delays:
                print(report(list(delays)) if fresh else "no new messages")
                fresh.clear()

        kind = type_of_topic(node, options.topic, wait=True)
        node.create_subscription(kind, options.topic, note, qos_profile_sensor_data)
        node.create_timer(1.0, show)
        rclpy.spin(node)
