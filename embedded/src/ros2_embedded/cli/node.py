"""`ros2 node`: list, info."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)

from ros2_embedded.cli.common import CliError, command_node, run, settle
from ros2_embedded.naming import is_hidden


def _define_list(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-a", "--all", action="store_true", help="also hidden nodes")
    parser.add_argument("-c", "--count-nodes", action="store_true", help="only their number")


def _list(options: argparse.Namespace) -> None:
    """Output a list of available nodes."""
    with command_node() as node:
        settle(node)
        own = node.get_fully_qualified_name()
        names = sorted(n for n in node.get_fully_qualified_node_names() if n != own)
    shown = [name for name in names if options.all or not is_hidden(name)]
    if len(set(shown)) < len(shown):
        print(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, "
            "which can have unintended side effects.",
            file=sys.stderr,
        )
    print(len(shown) if options.count_nodes else "\n".join(shown))


def _define_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("node_name")
    parser.add_argument("--include-hidden", action="store_true", help="also hidden topics")


def _info(options: argparse.Namespace) -> None:
    """Print information about a node."""
    full = "/" + options.node_name.strip("/")
    namespace, _, name = full.rpartition("/")
    with command_node() as node:
        settle(node)
        if full not in node.get_fully_qualified_node_names():
            raise CliError(f"Unable to find node '{options.node_name}'")
        where = (name, namespace or "/")
        sections = {
            "Subscribers": node.get_subscriber_names_and_types_by_node(*where),
            "Publishers": node.get_publisher_names_and_types_by_node(*where),
            "Service Servers": node.get_service_names_and_types_by_node(*where),
            "Service Clients": node.get_client_names_and_types_by_node(*where),
            "Action Servers": get_action_server_names_and_types_by_node(node, *where),
            "Action Clients": get_action_client_names_and_types_by_node(node, *where),
        }
    print(full)
    for title, entries in sections.items():
        print(f"  {title}:")
        for entry, types in entries:
            if options.include_hidden or not is_hidden(entry):
                print(f"    {entry}: {', '.join(types)}")


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 node ...`."""
    verbs = {"list": (_define_list, _list), "info": (_define_info, _info)}
    return run("node", "Various node related commands.", verbs, arguments)
