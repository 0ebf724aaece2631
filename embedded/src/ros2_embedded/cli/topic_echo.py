"""`ros2 topic echo`."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import rclpy
import yaml
from rclpy.node import Node
from rclpy.task import Future

from ros2_embedded.cli import topic_qos
from ros2_embedded.cli.command_node import add_options, command_node
from ros2_embedded.cli.common import CliError, flag, option, positive_float, unsigned_int
from ros2_embedded.cli.topic_type import message_type, type_of_topic
from ros2_embedded.message_text import is_message, to_csv, to_yaml

OPTIONS = (
    add_options,
    option("topic_name", help="Name of the ROS topic to listen to (e.g. '/chatter')"),
    option("message_type", nargs="?", help="Type of the ROS message (e.g. 'std_msgs/msg/String')"),
    *topic_qos.options("subscribe", "sensor_data"),
    flag("--csv",
         text="Output all recursive fields separated by commas (e.g. for plotting). If "
         "--include-message-info is also passed, the following fields are prepended: "
         "source_timestamp, received_timestamp, publication_sequence_number, "
         "reception_sequence_number."),
    option("--field",
           help="Echo a selected field of a message. Use '.' to select sub-fields. For example, to "
           "echo the position field of a nav_msgs/msg/Odometry message: 'ros2 topic echo /odom "
           "--field pose.pose.position'"),
    flag("--full-length", "-f",
         text="Output all elements for arrays, bytes, and string with a length > "
         "'--truncate-length', by default they are truncated after '--truncate-length' elements "
         "with '...''"),
    option("--truncate-length", "-l", type=unsigned_int, default=128,
           help="The length to truncate arrays, bytes, and string to (default: 128)"),
    flag("--no-arr", text="Don't print array fields of messages"),
    flag("--no-str", text="Don't print string fields of messages"),
    flag("--flow-style",
         text="Print collections in the block style (not available with csv format)"),
    flag("--no-lost-messages", text="Don't report when a message is lost"),
    flag("--raw", text="Echo the raw binary representation"),
    option("--filter", dest="filter_expr",
           help="Python expression to filter messages that are printed. Expression can use Python "
           "builtins as well as m (the message)."),
    flag("--once", text="Print the first message received and then exit."),
    option("--timeout", metavar="N", type=positive_float,
           help="Set a timeout in seconds for waiting"),
    flag("--include-message-info", "-i", text="Shows the associated message info."),
)  # fmt: skip


def expression(text: str | None) -> Callable[[Any], Any]:
    """A filter made from an expression of the message `m`; without text all messages pass."""
    if not text:
        return lambda m: True
    code = compile(text, "<filter>", "eval")
    return lambda m: eval(code, {"m": m})


def select(message: Any, path: list[str]) -> Any:
    """Returns a field of a message or of its sub-messages.

    Raises:
        CliError: There is no such field.
    """
    value = message
    for name in path:
        try:
            value = getattr(value, name)
        except AttributeError as error:
            raise CliError(f"Invalid field '{'.'.join(path)}': {error}") from error
    return value


def text_of(value: Any, options: argparse.Namespace, info: dict[str, Any]) -> str:
    """A message as the options want it, or the value of a field or raw data as Python shows it."""
    shown = info if options.include_message_info else {}
    if not is_message(value):
        head = f"---Got new message, message info:---\n{shown}\n---Message data:---\n"
        return f"{head if shown else ''}{value}\n---"
    limit = None if options.full_length else options.truncate_length
    arrays, strings = not options.no_arr, not options.no_str
    how: dict[str, Any] = {"truncate": limit, "arrays": arrays, "strings": strings}
    if options.csv:
        return ",".join([*map(str, shown.values()), to_csv(value, **how)])
    head = f"{yaml.safe_dump(shown)}---\n" if shown else ""
    return head + to_yaml(value, flow=options.flow_style, **how) + "---"


def _type(node: Node, options: argparse.Namespace) -> Any:
    if options.message_type is not None:
        return message_type(options.message_type)
    found = type_of_topic(node, options.topic_name, wait=False)
    if found is None:
        raise CliError("Could not determine the type for the passed topic")
    return found


def echo(options: argparse.Namespace) -> None:
    """Prints messages until Ctrl-C, or the first one."""
    path = None if options.field is None else [part for part in options.field.split(".") if part]
    if path == []:
        raise CliError(f"Invalid field value '{options.field}'")
    chosen = expression(options.filter_expr)
    end = Future()

    def show(message: Any, info: dict[str, Any]) -> None:
        value = select(message, path or [])
        if chosen(value) and not end.done():
            print(text_of(value, options, dict(info)))
            if options.once:
                end.set_result(None)

    with command_node(options, lambda node: node.count_publishers(options.topic_name)) as node:
        publishers = node.get_publishers_info_by_topic(options.topic_name)
        qos = topic_qos.profile_for(options, publishers)
        kind = _type(node, options)
        if options.timeout is not None:
            node.create_timer(options.timeout, lambda: end.set_result(None))
        node.create_subscription(kind, options.topic_name, show, qos, raw=options.raw)
        rclpy.spin_until_future_complete(node, end)
