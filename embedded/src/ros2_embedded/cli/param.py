"""`ros2 param`: list, get, set, dump."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import yaml
from rclpy.arguments import load_yaml
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python

from ros2_embedded.cli.common import CliError, command_node, run, settle, spin_until
from ros2_embedded.message_modules import service_class

_PATIENCE = 3.0
_TITLES = {
    Parameter.Type.BOOL: "Boolean value is",
    Parameter.Type.INTEGER: "Integer value is",
    Parameter.Type.DOUBLE: "Double value is",
    Parameter.Type.STRING: "String value is",
    Parameter.Type.BYTE_ARRAY: "Byte values are",
    Parameter.Type.BOOL_ARRAY: "Boolean values are",
    Parameter.Type.INTEGER_ARRAY: "Integer values are",
    Parameter.Type.DOUBLE_ARRAY: "Double values are",
    Parameter.Type.STRING_ARRAY: "String values are",
}


def _call(node: Node, target: str, service: str, **fields: Any) -> Any:
    """Calls one of the parameter services of a node."""
    snake = "".join(f"_{c.lower()}" if c.isupper() else c for c in service).lstrip("_")
    kind = service_class(f"rcl_interfaces/srv/{service}")
    client = node.create_client(kind, f"/{target.strip('/')}/{snake}")
    try:
        if not client.wait_for_service(_PATIENCE):
            raise CliError("Node not found")
        return spin_until(node, client.call_async(kind.Request(**fields)))
    finally:
        node.destroy_client(client)


def _names(node: Node, target: str) -> list[str]:
    return sorted(_call(node, target, "ListParameters").result.names)


def _values(node: Node, target: str, names: list[str]) -> list[Any]:
    return list(_call(node, target, "GetParameters", names=names).values)


def _define_list(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("node_name", nargs="?")


def _list(options: argparse.Namespace) -> None:
    """Output a list of available parameters."""
    with command_node() as node:
        if options.node_name:
            for name in _names(node, options.node_name):
                print(f"  {name}")
            return
        settle(node)
        suffix = "/list_parameters"
        services = [name for name, _ in node.get_service_names_and_types() if name.endswith(suffix)]
        for target in (name.removesuffix(suffix) for name in services):
            print(f"{target}:")
            for name in _names(node, target):
                print(f"  {name}")


def _define_get(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("node_name")
    parser.add_argument("parameter_name")
    parser.add_argument("--hide-type", action="store_true", help="only the value")


def _get(options: argparse.Namespace) -> None:
    """Get a parameter."""
    with command_node() as node:
        values = _values(node, options.node_name, [options.parameter_name])
    if not values:
        raise CliError("Parameter not set")
    value = parameter_value_to_python(values[0])
    if value is None:
        raise CliError("Parameter not set")
    print(value if options.hide_type else f"{_TITLES[Parameter.Type(values[0].type)]}: {value}")


def _define_set(parser: argparse.ArgumentParser) -> None:
    _define_get(parser)
    parser.add_argument("value", help="in YAML")


def _set(options: argparse.Namespace) -> None:
    """Set a parameter."""
    parameter = Parameter(options.parameter_name, value=load_yaml(options.value))
    with command_node() as node:
        message = parameter.to_parameter_msg()
        result = _call(node, options.node_name, "SetParameters", parameters=[message]).results[0]
    if not result.successful:
        raise CliError(f"Setting parameter failed: {result.reason}")
    print("Set parameter successful" + (f": {result.reason}" if result.reason else ""))


def _define_dump(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("node_name")


def _dump(options: argparse.Namespace) -> None:
    """Show all of the parameters of a node in a YAML file format."""
    with command_node() as node:
        names = _names(node, options.node_name)
        values = _values(node, options.node_name, names)
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=True):
        *groups, last = name.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[last] = parameter_value_to_python(value)
    full = "/" + options.node_name.strip("/")
    print(yaml.safe_dump({full: {"ros__parameters": tree}}, default_flow_style=False), end="")


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 param ...`."""
    verbs = {
        "list": (_define_list, _list),
        "get": (_define_get, _get),
        "set": (_define_set, _set),
        "dump": (_define_dump, _dump),
    }
    return run("param", "Various param related commands.", verbs, arguments)
