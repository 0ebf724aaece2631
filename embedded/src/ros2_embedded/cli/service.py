"""`ros2 service`: list, info, type, find, call."""

from __future__ import annotations

import argparse

from rclpy.node import Node

from ros2_embedded.cli import service_call
from ros2_embedded.cli.command_node import add_options, command_node
from ros2_embedded.cli.common import (
    Named,
    Verb,
    count_flag,
    define_verbs,
    hidden_flag,
    option,
    print_named,
    print_of_type,
    types_flag,
    visible,
)


def _services(node: Node, options: argparse.Namespace) -> Named:
    return visible(node.get_service_names_and_types(), options)


def _list(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        services = _services(node, options)
    print_named(services, options, types=options.show_types)


def _info(options: argparse.Namespace) -> str | None:
    name = options.service_name
    with command_node(options) as node:
        types = dict(_services(node, options)).get(name)
        if types is None:
            return f"Unknown service '{name}'"
        clients, services = node.count_clients(name), node.count_services(name)
    print(f"Type: {types[0] if len(types) == 1 else types}")
    print(f"Clients count: {clients}\nServices count: {services}")
    return None


def _type(options: argparse.Namespace) -> int:
    name = options.service_name
    with command_node(options, lambda node: name in dict(_services(node, options))) as node:
        types = dict(_services(node, options)).get(name)
    if types is None:
        return 1
    print("\n".join(types))
    return 0


def _find(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        found = _services(node, options)
    print_of_type(found, options.service_type, options)


_VERBS = {
    "call": Verb("Call a service", service_call.call, *service_call.OPTIONS),
    "find": Verb(
        "Output a list of available services of a given type",
        _find,
        option("service_type", help="Name of the ROS service type to filter for "
               "(e.g. 'rcl_interfaces/srv/ListParameters')"),
        count_flag("services"),
        hidden_flag("services"),
    ),
    "info": Verb(
        "Print information about a service",
        _info,
        add_options,
        option("service_name", help="Name of the ROS service to get info (e.g. '/add_two_ints')"),
    ),
    "list": Verb(
        "Output a list of available services",
        _list,
        add_options,
        types_flag("service"),
        count_flag("services"),
        hidden_flag("services"),
    ),
    "type": Verb(
        "Output a service's type",
        _type,
        option("service_name",
               help="Name of the ROS service to get type (e.g. '/talker/list_parameters')"),
    ),
}  # fmt: skip


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options and verbs of `ros2 service`."""
    hidden_flag("services")(parser)
    define_verbs(parser, _VERBS)
