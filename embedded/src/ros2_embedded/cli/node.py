"""`ros2 node`: list, info."""

from __future__ import annotations

import argparse
import sys

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import Node

from ros2_embedded.cli.command_node import add_options, command_node
from ros2_embedded.cli.common import Verb, count_flag, define_verbs, flag, option
from ros2_embedded.naming import is_hidden, join

Named = list[tuple[str, list[str]]]


def node_names(node: Node, hidden: bool) -> list[str]:
    """Full names of all nodes in the graph; a node whose own name begins with `_` is hidden."""
    found = node.get_node_names_and_namespaces()
    return [join(space, name) for name, space in found if hidden or not name.startswith("_")]


def _list(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        names = sorted(node_names(node, options.all))
    if options.count:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, "
            "which can have unintended side effects.",
            file=sys.stderr,
        )
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


def _info(options: argparse.Namespace) -> str | None:
    full = options.node_name
    namespace, _, name = full.rpartition("/")
    with command_node(options) as node:
        count = node_names(node, options.include_hidden).count(full)
        if not count:
            return f"Unable to find node '{full}'"
        sections = _sections(node, name, namespace or "/")
    if count > 1:
        print(
            f'There are {count} nodes in the graph with the exact name "{full}". '
            "You are seeing information about only one of them.",
            file=sys.stderr,
        )
    print(full)
    for title, entries in sections.items():
        shown = [e for e in entries if options.include_hidden or not is_hidden(e[0])]
        print(f"  {title}:")
        print("\n".join(f"    {entry}: {', '.join(types)}" for entry, types in shown))
    return None


_VERBS = {
    "info": Verb(
        "Output information about a node",
        _info,
        add_options,
        option("node_name", help="Node name to request information"),
        flag("--include-hidden", text="Display hidden topics, services, and actions as well"),
    ),
    "list": Verb(
        "Output a list of available nodes",
        _list,
        add_options,
        flag("-a", "--all", text="Display all nodes even hidden ones"),
        count_flag("nodes"),
    ),
}


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the verbs of `ros2 node`."""
    define_verbs(parser, _VERBS)
