"""`ros2 topic echo`."""

from __future__ import annotations

import argparse
import re
import time
from typing import Any

import rclpy
from rclpy.task import Future

from ros2_embedded.cli import topic_qos
from ros2_embedded.cli.common import CliError, command_node
from ros2_embedded.yaml_messages import DEFAULT_TRUNCATION, to_yaml


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options."""
    parser.add_argument("topic_name")
    parser.add_argument("message_type", nargs="?", help="needed if nobody publishes yet")
    parser.add_argument("--once", action="store_true", help="one message, then end")
    parser.add_argument("--timeout", type=float, metavar="S", help="end after this time [s]")
    parser.add_argument(
        "--field", metavar="NAME", help="a field of the message, as in pose.position"
    )
    parser.add_argument("--no-arr", action="store_true", help="do not write lists out")
    parser.add_argument("-f", "--full-length", action="store_true", help="write long lists out")
    parser.add_argument(
        "-l", "--truncate-length", type=int, default=DEFAULT_TRUNCATION, metavar="N"
    )
    topic_qos.define(parser)


def select(message: Any, path: str | None) -> Any:
    """The field of a message that `a.b[0].c` means.

    Raises:
        CliError: there is none.
    """
    value = message
    for name, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", path or ""):
        try:
            if name and name not in value.get_fields_and_field_types():
                raise AttributeError
            value = getattr(value, name) if name else value[int(index)]
        except (AttributeError, IndexError, TypeError):
            raise CliError(f"Invalid field '{path}': '{name or index}' is not there") from None
    return value


def echo(options: argparse.Namespace) -> int:
    """Output messages from a topic."""
    truncate = None if options.full_length else options.truncate_length
    with command_node() as node:
        cls, publishers = topic_qos.discover(node, options.topic_name, options.message_type)
        select(cls(), re.sub(r"\[\d+\].*", "", options.field or ""))
        first = Future()
        seen: list[bool] = []

        def show(message: Any) -> None:
            if options.once and seen:
                return
            seen.append(True)
            value = select(message, options.field)
            print(to_yaml(value, arrays=not options.no_arr, truncate=truncate) + "---", flush=True)
            if options.once:
                first.set_result(None)

        qos = topic_qos.profile(options, publishers)
        node.create_subscription(cls, options.topic_name, show, qos)
        start = time.monotonic()
        rclpy.spin_until_future_complete(node, first, timeout_sec=options.timeout)
        if options.once and not seen and options.timeout is not None:
            waited = time.monotonic() - start
            raise CliError(f"No message on '{options.topic_name}' within {waited:.1f} s")
    return 0
