"""`ros2 topic hz`."""

from __future__ import annotations

import argparse
import statistics
from collections import deque
from typing import Any

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.qos import qos_profile_sensor_data

from ros2_embedded.cli.command_node import add_direct_options, command_node
from ros2_embedded.cli.common import flag, option, window_option
from ros2_embedded.cli.topic_echo import expression
from ros2_embedded.cli.topic_type import type_of_topic

_PERIOD = 1_000_000_000
"""Shortest time between two lines [ns]."""


OPTIONS = (
    option("topic_name", help="Name of the ROS topic to listen to (e.g. '/chatter')"),
    window_option(10000, "window size, in # of messages, for calculating rate",
                  dest="window_size", metavar="WINDOW"),
    option("--filter", dest="filter_expr", metavar="EXPR",
           help="only measure messages matching the specified Python expression"),
    flag("--wall-time", dest="use_wtime",
         text="calculates rate using wall time which can be helpful when clock is not published "
         "during simulation"),
    add_direct_options,
)  # fmt: skip


class Rate:
    """The rate of messages, from their arrival times."""

    def __init__(self, window: int) -> None:
        """Counts at most `window` gaps between messages."""
        self._gaps: deque[int] = deque(maxlen=window)
        self._last: int | None = None
        self._reported: int | None = None

    def add(self, now: int) -> None:
        """Adds the arrival time of a message [ns]; a jump back resets the statistics."""
        if now == 0:
            if self._gaps:
                print("time has reset, resetting counters")
                self._gaps.clear()
            return
        if self._last is None or now < self._last:
            self._gaps.clear()
        else:
            self._gaps.append(now - self._last)
        self._last = now

    def report(self) -> str | None:
        """A report, at most once per second of the messages' time; otherwise None."""
        if not self._gaps or self._last is None:
            return None
        if self._reported is None:
            self._reported = self._last
        if self._last < self._reported + _PERIOD:
            return None
        self._reported = self._last
        gaps = list(self._gaps)
        mean = sum(gaps) / len(gaps)
        return (
            f"average rate: {1e9 / mean if mean > 0 else 0:.3f}\n"
            f"\tmin: {min(gaps) * 1e-9:.3f}s max: {max(gaps) * 1e-9:.3f}s "
            f"std dev: {statistics.pstdev(gaps) * 1e-9:.5f}s window: {len(gaps)}"
        )


def rate(options: argparse.Namespace) -> None:
    """Prints the rate until Ctrl-C."""
    chosen = expression(options.filter_expr)
    measured = Rate(options.window_size)
    with command_node(options, lambda node: node.count_publishers(options.topic_name)) as node:
        clock = Clock(clock_type=ClockType.SYSTEM_TIME) if options.use_wtime else node.get_clock()

        def count(message: Any) -> None:
            if not chosen(message):
                return
            measured.add(clock.now().nanoseconds)
            if text := measured.report():
                print(text)

        kind = type_of_topic(node, options.topic_name, wait=True)
        node.create_subscription(kind, options.topic_name, count, qos_profile_sensor_data)
        rclpy.spin(node)
