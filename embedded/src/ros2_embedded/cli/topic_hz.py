"""`ros2 topic hz`."""

from __future__ import annotations

import argparse
import statistics
import time
from collections import deque
from itertools import pairwise
from typing import Any

import rclpy

from ros2_embedded.cli import topic_qos
from ros2_embedded.cli.common import command_node

_WINDOW = 10000


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options."""
    parser.add_argument("topic_name")
    parser.add_argument("-w", "--window", type=int, default=_WINDOW, metavar="N",
                        help="messages to average over (default: %(default)s)")  # fmt: skip
    parser.add_argument(
        "-s", "--use-sim-time", action="store_true", help="measure on /clock's time"
    )
    topic_qos.define(parser)


def report(stamps: Any) -> str | None:
    """The rate of messages that came at these times [ns]; None if there are too few."""
    times = list(stamps)
    gaps = [(later - earlier) * 1e-9 for earlier, later in pairwise(times)]
    if not gaps or sum(gaps) <= 0:
        return None
    deviation = statistics.pstdev(gaps)
    return (
        f"average rate: {len(gaps) / sum(gaps):.3f}\n\tmin: {min(gaps):.3f}s max: {max(gaps):.3f}s "
        f"std dev: {deviation:.5f}s window: {len(times)}"
    )


def rate(options: argparse.Namespace) -> int:
    """Print the average publishing rate of a topic."""
    if options.window < 2:
        raise ValueError(f"--window must be at least 2, not {options.window}")
    stamps: deque[int] = deque(maxlen=options.window)
    with command_node(options.use_sim_time) as node:
        cls, publishers = topic_qos.discover(node, options.topic_name, None)
        clock = node.get_clock()
        node.create_subscription(
            cls,
            options.topic_name,
            lambda _: stamps.append(
                clock.nanoseconds() if options.use_sim_time else time.monotonic_ns()
            ),
            topic_qos.profile(options, publishers, default_depth=1000),
        )
        due, known = time.monotonic() + 1.0, 0
        while rclpy.ok():
            rclpy.spin_once(node, timeout_sec=max(0.0, due - time.monotonic()))
            if time.monotonic() >= due:
                due += 1.0
                text = report(stamps) if stamps and stamps[-1] != known else "no new messages"
                known = stamps[-1] if stamps else 0
                if text:
                    print(text, flush=True)
    return 0
