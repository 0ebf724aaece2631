"""`ros2 node`: list and info."""

from __future__ import annotations

import argparse
import sys

from rclpy.action import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import Node
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from ros2_commands.errors import CommandError
from ros2_commands.graph import Named, full_node_names, graph_node
from ros2_commands.options import Verbs, add_discovery


def _list(options: argparse.Namespace) -> None:
    """List the nodes."""
    with graph_node(options.spin_time) as node:
        names = full_node_names(node, options.all)
    if options.count:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print("WARNING: Be aware that there are nodes in the graph that share an exact name, "
              "which can have unintended side effects.", file=sys.stderr)  # fmt: skip
    for name in names:
        print(name)


def _sections(node: Node, name: str, namespace: str) -> dict[str, Named]:
    return {
        "Subscribers": node.get_subscriber_names_and_types_by_node(name, namespace),
        "Publishers": node.get_publisher_names_and_types_by_node(name, namespace),
        "Service Servers": node.get_service_names_and_types_by_node(name, namespace),
        "Service Clients": node.get_client_names_and_types_by_node(name, namespace),
        "Action Servers": get_action_server_names_and_types_by_node(node, name, namespace),
        "Action Clients": get_action_client_names_and_types_by_node(node, name, namespace),
    }


def _info(options: argparse.Namespace) -> None:
    """Print a node's topics, services and actions."""
    full = options.node_name
    namespace, _, name = full.rpartition("/")
    with graph_node(options.spin_time) as node:
        if full not in full_node_names(node, hidden=True):
            raise CommandError(f"Unable to find node '{full}'")
        sections = _sections(node, name, namespace or "/")
    print(full)
    for title, entries in sections.items():
        print(f"  {title}:")
        for entry, types in entries:
            if options.include_hidden or not topic_or_service_is_hidden(entry):
                print(f"    {entry}: {', '.join(types)}")
    print()


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs to the command's parser."""
    verbs = Verbs(parser)
    listing = verbs.add("list", _list)
    add_discovery(listing)
    listing.add_argument("-a", "--all", action="store_true", help="show hidden nodes as well")
    listing.add_argument("-c", "--count-nodes", dest="count", action="store_true",
                         help="show only the number")  # fmt: skip
    info = verbs.add("info", _info)
    add_discovery(info)
    info.add_argument("node_name", help="full name, as /talker")
    info.add_argument("--include-hidden", action="store_true",
                      help="show names that begin with _ as well")  # fmt: skip
