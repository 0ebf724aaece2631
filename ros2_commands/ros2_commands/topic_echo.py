"""`ros2 topic echo`."""

from __future__ import annotations

import argparse
from typing import Any

from rclpy.node import Node

from ros2_commands.errors import CommandError
from ros2_commands.graph import graph_node, spin
from ros2_commands.interface_classes import interface_class
from ros2_commands.message_text import is_message, to_csv, to_yaml
from ros2_commands.options import add_discovery, count
from ros2_commands.qos import add_qos, matching_profile


def define(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_discovery(parser)
    parser.add_argument("topic_name")
    parser.add_argument("message_type", nargs="?", help="by default the publishers'")
    add_qos(parser, "sensor_data")
    parser.add_argument("--once", action="store_true", help="end after the first message")
    parser.add_argument("--field", help="print only a part, as header.stamp")
    parser.add_argument("--csv", action="store_true", help="print a line of all fields")
    parser.add_argument("--flow-style", action="store_true", help="print each list in one line")
    parser.add_argument("-f", "--full-length", action="store_true", help="cut nothing")
    parser.add_argument("-l", "--truncate-length", type=count, default=128, metavar="N",
                        help="cut lists and strings after N elements")  # fmt: skip


def topic_class(node: Node, topic: str) -> Any:
    """Find the class of the messages on a topic.

    Raises:
        CommandError: Nobody uses the topic, or it has several types or an unknown one.
    """
    name = node.resolve_topic_name(topic)
    types = dict(node.get_topic_names_and_types()).get(name, [])
    if not types:
        raise CommandError(f"WARNING: topic [{topic}] does not appear to be published yet\n"
                           "Could not determine the type for the passed topic")  # fmt: skip
    if len(types) > 1:
        raise CommandError(f"Topic '{topic}' has more than one type: [{', '.join(types)}]")
    return interface_class(types[0], "msg")


def _part(message: Any, field: str | None) -> Any:
    value = message
    for name in field.split(".") if field else ():
        if not (is_message(value) and name in value.get_fields_and_field_types()):
            raise CommandError(f"Invalid field '{field}': no '{name}' in {type(value).__name__}")
        value = getattr(value, name)
    return value


def _text(value: Any, options: argparse.Namespace) -> str:
    longest = None if options.full_length else options.truncate_length
    if options.csv:
        return to_csv(value, longest)
    body = to_yaml(value, longest, options.flow_style) if is_message(value) else f"{value}\n"
    return f"{body}---"


def echo(options: argparse.Namespace) -> None:
    """Print the messages of a topic until Ctrl-C."""
    seen: list[bool] = []

    def show(message: Any) -> None:
        if not (options.once and seen):
            print(_text(_part(message, options.field), options))
            seen.append(True)

    name = options.topic_name
    with graph_node(options.spin_time, lambda node: node.count_publishers(name)) as node:
        kind = options.message_type
        found = interface_class(kind, "msg") if kind else topic_class(node, name)
        profile = matching_profile(options, node.get_publishers_info_by_topic(name))
        node.create_subscription(found, name, show, profile)
        spin(node, lambda: options.once and seen)
