"""`ros2 topic hz`."""

from __future__ import annotations

import argparse
import statistics
import time
from collections import deque
from typing import Any

from rclpy.qos import qos_profile_sensor_data

from ros2_commands.graph import graph_node, spin
from ros2_commands.options import add_discovery, count
from ros2_commands.topic_echo import topic_class

_POLL = 0.1  # [s]


def define(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_discovery(parser)
    parser.add_argument("topic_name")
    parser.add_argument("-w", "--window", type=count, default=10000, metavar="N",
                        help="number of messages that the mean is taken of")  # fmt: skip


class Rate:
    """The rate of messages by their arrival times in [s]; `window` is how many gaps count."""

    def __init__(self, window: int) -> None:
        self._gaps: deque[float] = deque(maxlen=window)
        self._last: float | None = None
        self._reported = 0.0

    def add(self, now: float) -> str | None:
        """Count a message; at most once a second, give a report."""
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


def rate(options: argparse.Namespace) -> None:
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
        kind = topic_class(node, name)
        node.create_subscription(kind, name, note, qos_profile_sensor_data, raw=True)
        spin(node)
