"""`ros2 topic bw`."""

from __future__ import annotations

import argparse
from collections import deque

import rclpy
from rclpy.qos import qos_profile_sensor_data

from ros2_embedded.cli.command_node import add_direct_options, command_node
from ros2_embedded.cli.common import option, window_option
from ros2_embedded.cli.topic_type import type_of_topic

OPTIONS = (
    option("topic", help="Topic name to monitor for bandwidth utilization"),
    window_option(
        100, "maximum window size, in # of messages, for calculating rate", metavar="WINDOW"
    ),
    add_direct_options,
)


def report(sizes: list[int], seconds: float) -> str:
    """Sizes of messages [B] that came within a time [s], as text; all in the rate's unit."""
    rate = sum(sizes) / seconds
    if rate < 1000:
        unit, digits, scale = "B", 0, 1.0
    elif rate < 1_000_000:
        unit, digits, scale = "KB", 2, 1e3
    else:
        unit, digits, scale = "MB", 2, 1e6
    numbers = (rate, sum(sizes) / len(sizes), min(sizes), max(sizes))
    total, mean, least, most = (f"{number / scale:.{digits}f} {unit}" for number in numbers)
    return (
        f"{total}/s from {len(sizes)} messages\n"
        f"\tMessage size mean: {mean} min: {least} max: {most}"
    )


def bandwidth(options: argparse.Namespace) -> None:
    """Prints the bandwidth until Ctrl-C."""
    received: deque[tuple[int, int]] = deque(maxlen=options.window)
    with command_node(options, lambda node: node.count_publishers(options.topic)) as node:
        clock = node.get_clock()

        def note(data: bytes) -> None:
            received.append((clock.now().nanoseconds, len(data)))

        def show() -> None:
            if len(received) > 1:
                seconds = (clock.now().nanoseconds - received[0][0]) * 1e-9
                if seconds > 0:
                    print(report([size for _, size in received], seconds))

        kind = type_of_topic(node, options.topic, wait=True)
        node.create_subscription(kind, options.topic, note, qos_profile_sensor_data, raw=True)
        print(f"Subscribed to [{options.topic}]")
        node.create_timer(1.0, show)
        rclpy.spin(node)
