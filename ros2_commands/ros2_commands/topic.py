"""`ros2 topic`: its verbs, and of them list, info and type."""

from __future__ import annotations

import argparse

from ros2_commands import topic_echo, topic_hz, topic_pub
from ros2_commands.errors import CommandError
from ros2_commands.graph import graph_node, print_named, print_type
from ros2_commands.options import Verbs, add_discovery, add_listing


def _list(options: argparse.Namespace) -> None:
    """List the topics."""
    with graph_node(options.spin_time) as node:
        topics = node.get_topic_names_and_types()
    print_named(topics, types=options.show_types, count=options.count, hidden=options.hidden)


def _info(options: argparse.Namespace) -> None:
    """Print a topic's type and who publishes and subscribes to it."""
    name = options.topic_name
    with graph_node(options.spin_time) as node:
        types = dict(node.get_topic_names_and_types()).get(name)
        if types is None:
            raise CommandError(f"Unknown topic '{name}'")
        sides = {
            "Publisher": node.get_publishers_info_by_topic(name),
            "Subscription": node.get_subscriptions_info_by_topic(name),
        }
    end = "\n\n" if options.verbose else "\n"
    print(f"Type: {types[0] if len(types) == 1 else types}", end=end)
    for title, ends in sides.items():
        print(f"{title} count: {len(ends)}", end=end)
        for each in ends if options.verbose else ():
            print(each, end=end)


def _type(options: argparse.Namespace) -> None:
    """Print a topic's type."""
    name = options.topic_name
    with graph_node(
        options.spin_time, lambda node: name in dict(node.get_topic_names_and_types())
    ) as node:
        print_type(node.get_topic_names_and_types(), name)


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs."""
    verbs = Verbs(parser)
    add_listing(verbs.add("list", _list), "topics")
    info = verbs.add("info", _info)
    add_discovery(info)
    info.add_argument("topic_name")
    info.add_argument("-v", "--verbose", action="store_true",
                      help="show node, type hash, GID and QoS of each end")  # fmt: skip
    kind = verbs.add("type", _type)
    add_discovery(kind)
    kind.add_argument("topic_name")
    topic_echo.define(verbs.add("echo", topic_echo.echo))
    topic_hz.define(verbs.add("hz", topic_hz.rate))
    topic_pub.define(verbs.add("pub", topic_pub.publish))
