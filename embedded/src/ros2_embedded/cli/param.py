"""`ros2 param`: list, get, set, describe, delete, dump, load."""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import yaml
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue
from rclpy.node import Node
from rclpy.parameter import Parameter, get_parameter_value, parameter_dict_from_yaml_file

from ros2_embedded.cli import param_calls
from ros2_embedded.cli.command_node import add_options, command_node
from ros2_embedded.cli.common import CliError, Verb, define_verbs, flag, option, whole
from ros2_embedded.cli.node import node_names

_POLL = 0.1


def _full(name: str) -> str:
    return name if name.startswith("/") else f"/{name}"


@contextmanager
def _target(options: argparse.Namespace) -> Iterator[tuple[Node, str]]:
    """A node of ours, and the full name of the user's, which is there."""
    target = _full(options.node_name)

    def found(node: Node) -> bool:
        return target in node_names(node, options.include_hidden_nodes)

    with command_node(options, found) as node:
        deadline = time.monotonic() + options.timeout
        while not found(node):
            if options.timeout >= 0 and time.monotonic() > deadline:
                raise CliError("Node not found")
            time.sleep(_POLL)
        yield node, target


def _list(options: argparse.Namespace) -> None:
    pattern = re.compile(options.filter[0] if options.filter else "")
    with command_node(options) as node:
        targets = sorted(set(node_names(node, options.include_hidden_nodes)))
        if options.node_name:
            wanted = _full(options.node_name)
            if wanted not in targets:
                raise CliError("Node not found")
            targets = [wanted]
        for target in targets:
            try:
                names = param_calls.names(node, target, options.param_prefixes)
            except CliError as error:
                print(error)
                continue
            shown = [name for name in names if pattern.match(name)]
            if not options.node_name and shown:
                print(f"{target}:")
            kinds = {}
            if options.param_type:
                for found in param_calls.describe(node, target, shown):
                    kinds[found.name] = f" (type: {param_calls.type_name(found.type)})"
            for name in shown:
                print(f"  {name}{kinds.get(name, '')}")


def _get(options: argparse.Namespace) -> str | None:
    with _target(options) as (node, target):
        values = param_calls.values(node, target, [options.parameter_name])
    if not values:
        return "Parameter not set"
    value, kind = param_calls.plain(values[0]), Parameter.Type(values[0].type)
    if options.hide_type:
        print(value)
    elif kind == Parameter.Type.NOT_SET:
        print("Parameter not set.")
    else:
        title = kind.name.removesuffix("_ARRAY").capitalize().replace("Bool", "Boolean")
        print(f"{title} {'values are' if isinstance(value, list) else 'value is'}: {value}")
    return None


def _parameter(name: str, value: Any) -> Any:
    return ParameterMessage(name=name, value=value)


def _set(options: argparse.Namespace) -> None:
    with _target(options) as (node, target):
        parameter = _parameter(options.parameter_name, get_parameter_value(options.value))
        result = param_calls.change(node, target, [parameter])[0]
    _tell(result, "Set parameter successful", "Setting parameter failed")


def _tell(result: Any, success: str, failure: str) -> None:
    """Prints how it went: a refusal is no failure of the command's."""
    text = success if result.successful else failure
    text += f": {result.reason}" if result.reason else ""
    print(text, file=sys.stdout if result.successful else sys.stderr)


def _delete(options: argparse.Namespace) -> None:
    with _target(options) as (node, target):
        nothing = _parameter(options.parameter_name, ParameterValue())
        result = param_calls.change(node, target, [nothing])[0]
    _tell(result, "Deleted parameter successfully", "Deleting parameter failed")


def _describe(options: argparse.Namespace) -> None:
    with _target(options) as (node, target):
        found = param_calls.describe(node, target, options.parameter_names)
    for descriptor in found:
        print(f"Parameter name: {descriptor.name}")
        print(f"  Type: {param_calls.type_name(descriptor.type)}")
        if descriptor.description:
            print(f"  Description: {descriptor.description}")
        print("  Constraints:")
        if descriptor.read_only:
            print("    Read only: true")
        for limits in [*descriptor.floating_point_range, *descriptor.integer_range][:1]:
            print(f"    Min value: {limits.from_value}\n    Max value: {limits.to_value}")
            if limits.step:
                print(f"    Step: {limits.step}")
        if descriptor.additional_constraints:
            print(f"    Additional constraints: {descriptor.additional_constraints}")


def _nested(flat: dict[str, Any]) -> dict[str, Any]:
    """Names with dots become mappings within mappings."""
    tree: dict[str, Any] = {}
    for name, value in flat.items():
        *groups, last = name.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[last] = value
    return tree


def _dump(options: argparse.Namespace) -> None:
    with _target(options) as (node, target):
        names = param_calls.names(node, target)
        values = param_calls.values(node, target, names)
    found = {
        name: param_calls.plain(value) for name, value in zip(names, values, strict=False)
    }  # fmt: skip
    tree = {target: {"ros__parameters": _nested(found)}}
    print(yaml.safe_dump(tree, default_flow_style=False))


def _load(options: argparse.Namespace) -> None:
    with _target(options) as (node, target):
        wildcard = not options.no_use_wildcard
        found = parameter_dict_from_yaml_file(options.parameter_file, wildcard)
        parameters = list(found.values())
        results = param_calls.change(node, target, parameters)
    for parameter, result in zip(parameters, results, strict=True):
        what = f"Set parameter {parameter.name}"
        _tell(result, f"{what} successful", f"{what} failed")


_NODE = option("node_name", help="Name of the ROS node")
_HIDDEN = flag("--include-hidden-nodes", text="Consider hidden nodes as well")
_NAME = option("parameter_name", help="Name of the parameter")
_TIMEOUT = option(
    "--timeout",
    metavar="N",
    type=whole,
    default=1,
    help="Wait for N seconds until node becomes available (default %(default)s sec)",
)
_COMMON = (add_options, _NODE, _HIDDEN)
_VERBS = {
    "delete": Verb("Delete parameter", _delete, *_COMMON, _NAME, _TIMEOUT),
    "describe": Verb(
        "Show descriptive information about declared parameters",
        _describe,
        *_COMMON,
        option("parameter_names", nargs="+", help="Names of the parameters"),
        _TIMEOUT,
    ),
    "dump": Verb(
        "Show all of the parameters of a node in a YAML file format", _dump, *_COMMON, _TIMEOUT
    ),
    "get": Verb(
        "Get parameter",
        _get,
        *_COMMON,
        _NAME,
        flag("--hide-type", text="Hide the type information"),
        _TIMEOUT,
    ),
    "list": Verb(
        "Output a list of available parameters",
        _list,
        add_options,
        option("node_name", nargs="?", help="Name of the ROS node"),
        option("--filter", nargs=1,
               help="Only parameters matching the regex expression will be showed. Supports `re` "
               "regex syntax."),
        _HIDDEN,
        option("--param-prefixes", nargs="+", default=[],
               help="Only list parameters with the provided prefixes"),
        flag("--param-type", text="Print parameter types with parameter names"),
    ),
    "load": Verb(
        "Load parameter file for a node",
        _load,
        *_COMMON,
        option("parameter_file", help="Parameter file"),
        flag("--no-use-wildcard",
             text="Do not load parameters in the '/**' namespace into the node"),
        _TIMEOUT,
    ),
    "set": Verb(
        "Set parameter",
        _set,
        *_COMMON,
        _NAME,
        option("value", help="Value of the parameter"),
        _TIMEOUT,
    ),
}  # fmt: skip


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the verbs of `ros2 param`."""
    define_verbs(parser, _VERBS)
