"""`ros2 topic`: its verbs, and of them list, info, type, find."""

from __future__ import annotations

import argparse

from rclpy.node import Node

from ros2_embedded.cli import topic_bw, topic_delay, topic_echo, topic_hz, topic_pub
from ros2_embedded.cli.command_node import add_options, command_node
from ros2_embedded.cli.common import (
    Named,
    Verb,
    count_flag,
    define_verbs,
    flag,
    hidden_flag,
    option,
    print_named,
    print_of_type,
    types_flag,
    visible,
)


def _topics(node: Node, options: argparse.Namespace) -> Named:
    return visible(node.get_topic_names_and_types(), options)


def _list(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        topics = _topics(node, options)
        counts = {
            name: (node.count_publishers(name), node.count_subscribers(name)) for name, _ in topics
        }
    if options.verbose and topics and not options.count:
        for way, (title, noun) in enumerate(_SIDES):
            print(f"{title} topics:")
            for name, types in topics:
                if count := counts[name][way]:
                    plural = "s" if count > 1 else ""
                    print(f" * {name} [{', '.join(types)}] {count} {noun}{plural}")
            print()
    else:
        print_named(topics, options, types=options.show_types)


_SIDES = (("Published", "publisher"), ("Subscribed", "subscriber"))


def _info(options: argparse.Namespace) -> str | None:
    name = options.topic_name
    with command_node(options) as node:
        types = dict(node.get_topic_names_and_types()).get(name)
        if types is None:
            return f"Unknown topic '{name}'"
        sides = (
            ("Publisher", node.get_publishers_info_by_topic(name)),
            ("Subscription", node.get_subscriptions_info_by_topic(name)),
        )
    end = "\n\n" if options.verbose else "\n"
    print(f"Type: {types[0] if len(types) == 1 else types}", end=end)
    for title, endpoints in sides:
        print(f"{title} count: {len(endpoints)}", end=end)
        for endpoint in endpoints if options.verbose else ():
            print(endpoint, end=end)
    return None


def _type(options: argparse.Namespace) -> int:
    name = options.topic_name
    with command_node(options, lambda node: name in dict(_topics(node, options))) as node:
        types = dict(_topics(node, options)).get(name)
    if types is None:
        return 1
    print("\n".join(types))
    return 0


def _find(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        found = _topics(node, options)
    print_of_type(found, options.topic_type, options)


_VERBS = {
    "bw": Verb("Display bandwidth used by topic", topic_bw.bandwidth, *topic_bw.OPTIONS),
    "delay": Verb(
        "Display delay of topic from timestamp in header", topic_delay.delay, *topic_delay.OPTIONS
    ),
    "echo": Verb("Output messages from a topic", topic_echo.echo, *topic_echo.OPTIONS),
    "find": Verb(
        "Output a list of available topics of a given type",
        _find,
        add_options,
        option("topic_type",
               help="Name of the ROS topic type to filter for (e.g. 'std_msg/msg/String')"),
        count_flag("topics"),
        hidden_flag("topics"),
    ),
    "hz": Verb("Print the average publishing rate to screen", topic_hz.rate, *topic_hz.OPTIONS),
    "info": Verb(
        "Print information about a topic",
        _info,
        add_options,
        option("topic_name", help="Name of the ROS topic to get info (e.g. '/chatter')"),
        flag("--verbose", "-v",
             text="Prints detailed information like the node name, node namespace, topic type, "
             "topic type hash, GUID, and QoS Profile of the publishers and subscribers to this "
             "topic"),
    ),
    "list": Verb(
        "Output a list of available topics",
        _list,
        add_options,
        types_flag("topic"),
        count_flag("topics"),
        hidden_flag("topics"),
        flag("-v", "--verbose", text="List full details about each topic"),
    ),
    "pub": Verb("Publish a message to a topic", topic_pub.publish, *topic_pub.OPTIONS),
    "type": Verb(
        "Print a topic's type",
        _type,
        add_options,
        option("topic_name", help="Name of the ROS topic to get type (e.g. '/chatter')"),
    ),
}  # fmt: skip


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options and verbs of `ros2 topic`."""
    hidden_flag("topics")(parser)
    define_verbs(parser, _VERBS)
