"""`ros2 param`: list, get, set, describe and dump."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import yaml
from rcl_interfaces.msg import Parameter as ParameterMessage
from rclpy.node import Node
from rclpy.parameter import Parameter, get_parameter_value, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

from ros2_commands.errors import CommandError
from ros2_commands.graph import full_node_names, graph_node, result
from ros2_commands.options import Verbs, add_discovery

_PATIENCE = 5.0  # longest wait for the parameter services of a node [s]
_POLL = 0.05  # [s]


def _await_services(client: AsyncParameterClient, target: str) -> None:
    end = time.monotonic() + _PATIENCE
    while not client.services_are_ready():
        if time.monotonic() > end:
            raise CommandError(f"Node {target} has no parameter services")
        time.sleep(_POLL)


@contextmanager
def _target(options: argparse.Namespace) -> Iterator[tuple[Node, AsyncParameterClient]]:
    """Yield a node of ours, and a client for the parameters of the user's."""
    name = _full(options.node_name)
    with graph_node(
        options.spin_time, lambda node: name in full_node_names(node, hidden=True)
    ) as node:
        if name not in full_node_names(node, hidden=True):
            raise CommandError("Node not found")
        client = AsyncParameterClient(node, name)
        _await_services(client, name)
        yield node, client


def _full(name: str) -> str:
    return name if name.startswith("/") else f"/{name}"


def _list(options: argparse.Namespace) -> None:
    """List the parameters of one node, or of all."""
    with graph_node(options.spin_time) as node:
        names = sorted(set(full_node_names(node)))
        if options.node_name:
            if _full(options.node_name) not in names:
                raise CommandError("Node not found")
            names = [_full(options.node_name)]
        clients = {name: AsyncParameterClient(node, name) for name in names}
        for name, client in clients.items():
            _await_services(client, name)
            if not options.node_name:
                print(f"{name}:")
            for each in sorted(result(node, client.list_parameters()).result.names):
                print(f"  {each}")


def _plain(value: Any) -> Any:
    """Return Python's value of a parameter; rows are lists."""
    found = parameter_value_to_python(value)
    return found if found is None or isinstance(found, (bool, int, float, str)) else list(found)


def _get(options: argparse.Namespace) -> None:
    """Print the value of a parameter."""
    with _target(options) as (node, client):
        values = result(node, client.get_parameters([options.parameter_name])).values
    if not values:
        raise CommandError("Parameter not set")
    value, kind = _plain(values[0]), Parameter.Type(values[0].type)
    if options.hide_type:
        print(value)
    elif kind == Parameter.Type.NOT_SET:
        print("Parameter not set.")
    else:
        title = kind.name.removesuffix("_ARRAY").capitalize().replace("Bool", "Boolean")
        print(f"{title} {'values are' if isinstance(value, list) else 'value is'}: {value}")


def _set(options: argparse.Namespace) -> None:
    """Set a parameter."""
    parameter = ParameterMessage(name=options.parameter_name)
    parameter.value = get_parameter_value(options.value)
    with _target(options) as (node, client):
        answer = result(node, client.set_parameters([parameter])).results[0]
    reason = f": {answer.reason}" if answer.reason else ""
    if answer.successful:
        print(f"Set parameter successful{reason}")
    else:  # no failure of the command, as in ROS 2
        print(f"Setting parameter failed{reason}", file=sys.stderr)


def _describe(options: argparse.Namespace) -> None:
    """Print type, description and limits of parameters."""
    with _target(options) as (node, client):
        found = result(node, client.describe_parameters(options.parameter_names)).descriptors
    for each in found:
        kind = Parameter.Type(each.type).name.lower().replace("bool", "boolean")
        print(f"Parameter name: {each.name}\n  Type: {kind.replace('_', ' ')}")
        if each.description:
            print(f"  Description: {each.description}")
        print("  Constraints:")
        if each.read_only:
            print("    Read only: true")
        for limits in [*each.floating_point_range, *each.integer_range]:
            print(f"    Min value: {limits.from_value}\n    Max value: {limits.to_value}")
        if each.additional_constraints:
            print(f"    Additional constraints: {each.additional_constraints}")


def _dump(options: argparse.Namespace) -> None:
    """Print all parameters of a node as a parameter file."""
    with _target(options) as (node, client):
        names = sorted(result(node, client.list_parameters()).result.names)
        values = result(node, client.get_parameters(names)).values
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=True):
        *groups, last = name.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[last] = _plain(value)
    print(yaml.safe_dump({_full(options.node_name): {"ros__parameters": tree}}))


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs to the command's parser."""
    verbs = Verbs(parser)
    listing = verbs.add("list", _list)
    add_discovery(listing)
    listing.add_argument("node_name", nargs="?")
    for name, run in (("get", _get), ("set", _set), ("describe", _describe), ("dump", _dump)):
        verb = verbs.add(name, run)
        add_discovery(verb)
        verb.add_argument("node_name")
        if name in ("get", "set"):
            verb.add_argument("parameter_name")
        if name == "get":
            verb.add_argument("--hide-type", action="store_true", help="print only the value")
        elif name == "set":
            verb.add_argument("value", help="in YAML")
        elif name == "describe":
            verb.add_argument("parameter_names", nargs="+")
