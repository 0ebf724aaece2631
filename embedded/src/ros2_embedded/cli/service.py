"""`ros2 service`: list, info, type, find, call."""

from __future__ import annotations

import argparse

from rclpy.node import Node

from ros2_embedded.cli import service_call
from ros2_embedded.cli.command_node import add_options, command_node
from ros2_embedded.cli.common import Verb, define_verbs
from ros2_embedded.naming import is_hidden


def _add_hidden(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--include-hidden-services", action="store_true", help="Consider hidden services as well"
    )


def _add_count(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-c",
        "--count-services",
        action="store_true",
        help="Only display the number of services discovered",
    )


def _services(node: Node, options: argparse.Namespace) -> list[tuple[str, list[str]]]:
    found = node.get_service_names_and_types()
    return [pair for pair in found if options.include_hidden_services or not is_hidden(pair[0])]


def _define_list(parser: argparse.ArgumentParser) -> None:
    add_options(parser)
    parser.add_argument(
        "-t", "--show-types", action="store_true", help="Additionally show the service type"
    )
    _add_count(parser)
    _add_hidden(parser)


def _list(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        services = _services(node, options)
    if options.count_services:
        print(len(services))
        return
    for name, types in services:
        print(f"{name} [{', '.join(types)}]" if options.show_types else name)


def _define_info(parser: argparse.ArgumentParser) -> None:
    add_options(parser)
    parser.add_argument(
        "service_name", help="Name of the ROS service to get info (e.g. '/add_two_ints')"
    )


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


def _define_type(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "service_name", help="Name of the ROS service to get type (e.g. '/talker/list_parameters')"
    )


def _type(options: argparse.Namespace) -> int:
    name = options.service_name
    with command_node(options, lambda node: name in dict(_services(node, options))) as node:
        types = dict(_services(node, options)).get(name)
    if types is None:
        return 1
    print("\n".join(types))
    return 0


def _define_find(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "service_type",
        help="Name of the ROS service type to filter for "
        "(e.g. 'rcl_interfaces/srv/ListParameters')",
    )
    _add_count(parser)
    _add_hidden(parser)


def _find(options: argparse.Namespace) -> None:
    with command_node(options) as node:
        found = [name for name, types in _services(node, options) if options.service_type in types]
    if options.count_services:
        print(len(found))
        return
    for name in found:
        print(name)


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options and verbs of `ros2 service`."""
    _add_hidden(parser)
    verbs = {
        "call": Verb("Call a service", service_call.define, service_call.call),
        "find": Verb("Output a list of available services of a given type", _define_find, _find),
        "info": Verb("Print information about a service", _define_info, _info),
        "list": Verb("Output a list of available services", _define_list, _list),
        "type": Verb("Output a service's type", _define_type, _type),
    }
    define_verbs(parser, verbs)
