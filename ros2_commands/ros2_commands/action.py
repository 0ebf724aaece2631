"""`ros2 action`: its verbs, and of them list and info."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import suppress

from rclpy.action import (
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import Node

from ros2_commands import action_goal
from ros2_commands.graph import Named, graph_node, print_named
from ros2_commands.options import Verbs, add_discovery, add_listing


def _list(options: argparse.Namespace) -> None:
    """List the actions."""
    with graph_node(options.spin_time) as node:
        actions = get_action_names_and_types(node)
    print_named(actions, types=options.show_types, count=options.count, hidden=options.hidden)


def _info(options: argparse.Namespace) -> None:
    """Print the nodes that serve an action and those that call it."""
    name = options.action_name
    with graph_node(options.spin_time) as node:
        sides = {
            "clients": _ends(node, name, get_action_client_names_and_types_by_node),
            "servers": _ends(node, name, get_action_server_names_and_types_by_node),
        }
    print(f"Action: {name}")
    for title, ends in sides.items():
        print(f"Action {title}: {len(ends)}")
        for owner, types in ends:
            print(f"    {owner} [{', '.join(types)}]" if options.show_types else f"    {owner}")


def _ends(node: Node, action: str, by_node: Callable[[Node, str, str], Named]) -> Named:
    """List the nodes with a client, or a server, of the action, with its types."""
    wanted = node.resolve_topic_name(action)
    found = []
    for name, space in node.get_node_names_and_namespaces():
        with suppress(RuntimeError):  # it left in between
            types = dict(by_node(node, name, space)).get(wanted)
            if types:
                found.append((f"{space.rstrip('/')}/{name}", types))
    return found


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs."""
    verbs = Verbs(parser)
    add_listing(verbs.add("list", _list), "actions")
    info = verbs.add("info", _info)
    add_discovery(info)
    info.add_argument("action_name")
    info.add_argument("-t", "--show-types", action="store_true", help="show types as well")
    action_goal.define(verbs.add("send_goal", action_goal.send_goal))
