"""`ros2 service`: list, type and call."""

from __future__ import annotations

import argparse
import time

from ros2_commands.graph import bare_node, graph_node, print_named, print_type, result
from ros2_commands.interface_classes import interface_class
from ros2_commands.message_values import message_from_yaml
from ros2_commands.options import Verbs, add_discovery, add_listing, positive


def _list(options: argparse.Namespace) -> None:
    """List the services."""
    with graph_node(options.spin_time) as node:
        services = node.get_service_names_and_types()
    print_named(services, types=options.show_types, count=options.count, hidden=options.hidden)


def _type(options: argparse.Namespace) -> None:
    """Print a service's type."""
    name = options.service_name
    with graph_node(
        options.spin_time, lambda node: name in dict(node.get_service_names_and_types())
    ) as node:
        print_type(node.get_service_names_and_types(), name)


def _call(options: argparse.Namespace) -> None:
    """Call a service, once or until Ctrl-C."""
    kind = interface_class(options.service_type, "srv")
    request = message_from_yaml(kind.Request, options.values)
    with bare_node() as node:
        client = node.create_client(kind, options.service_name)
        if not client.service_is_ready():
            print("waiting for service to become available...")
            client.wait_for_service()
        while True:
            called = time.monotonic()
            print(f"requester: making request: {request!r}\n")
            print(f"response:\n{result(node, client.call_async(request))!r}\n")
            if options.rate is None:
                return
            time.sleep(max(0.0, called + 1.0 / options.rate - time.monotonic()))


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs."""
    verbs = Verbs(parser)
    add_listing(verbs.add("list", _list), "services")
    kind = verbs.add("type", _type)
    add_discovery(kind)
    kind.add_argument("service_name")
    call = verbs.add("call", _call)
    call.add_argument("service_name")
    call.add_argument("service_type")
    call.add_argument("values", nargs="?", default="{}", help="request in YAML: '{data: true}'")
    call.add_argument("-r", "--rate", type=positive, metavar="N", help="repeat the call at N Hz")
