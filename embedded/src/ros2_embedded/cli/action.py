"""`ros2 action`: list, info, type, send_goal."""

from __future__ import annotations

import argparse
from contextlib import suppress

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)
from rclpy.exceptions import NameValidationException, NodeNameNonExistentError
from rclpy.node import Node

from ros2_embedded.cli import action_goal
from ros2_embedded.cli.command_node import command_node
from ros2_embedded.cli.common import (
    CliError,
    Verb,
    count_flag,
    define_verbs,
    flag,
    option,
    print_named,
    types_flag,
)
from ros2_embedded.naming import join


def _list(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        actions = get_action_names_and_types(node)
    print_named(actions, options, types=options.show_types)


def _info(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        sides = {
            "clients": _ends(node, options.action_name, get_action_client_names_and_types_by_node),
            "servers": _ends(node, options.action_name, get_action_server_names_and_types_by_node),
        }
    print(f"Action: {options.action_name}")
    for title, ends in sides.items():
        print(f"Action {title}: {len(ends)}")
        for name, types in () if options.count else ends:
            print(f"    {name} [{', '.join(types)}]" if options.show_types else f"    {name}")


def _ends(node: Node, action: str, by_node: object) -> list[tuple[str, list[str]]]:
    """Nodes that have a client, or a server, of the action, with its types."""
    try:
        wanted = node.resolve_topic_name(action)
    except NameValidationException as error:
        raise CliError(str(error)) from error
    found = []
    for name, namespace in node.get_node_names_and_namespaces():
        with suppress(NodeNameNonExistentError):  # it left in between
            for known, types in by_node(node, name, namespace):  # type: ignore[operator]
                if known == wanted:
                    found.append((join(namespace, name), types))
    return found


def _type(options: argparse.Namespace) -> int:
    name = options.action_name
    with command_node(options, lambda node: name in dict(get_action_names_and_types(node))) as node:
        types = dict(get_action_names_and_types(node)).get(name)
    if types is None:
        return 1
    print("\n".join(types))
    return 0


_NAME = option("action_name", help="Name of the ROS action to get info (e.g. '/fibonacci')")
_VERBS = {
    "info": Verb(
        "Print information about an action",
        _info,
        _NAME,
        types_flag("action"),
        flag("-c", "--count", text="Only display the number of action clients and action servers"),
    ),
    "list": Verb(
        "Output a list of action names", _list, types_flag("action"), count_flag("actions")
    ),
    "send_goal": Verb("Send an action goal", action_goal.send_goal, *action_goal.OPTIONS),
    "type": Verb("Print a action's type", _type, _NAME),
}


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the verbs of `ros2 action`."""
    define_verbs(parser, _VERBS)
