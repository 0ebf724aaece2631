"""`ros2 service`: list, type, call."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from ros2_embedded.cli.common import (
    CliError,
    command_node,
    define_list,
    filled,
    interface,
    print_list,
    run,
    settle,
    spin_until,
)


def _define_list(parser: argparse.ArgumentParser) -> None:
    define_list(parser, "services")


def _list(options: argparse.Namespace) -> None:
    """Output a list of available services."""
    with command_node() as node:
        settle(node)
        services = node.get_service_names_and_types()
    print_list(options, services)


def _define_type(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("service_name")


def _type(options: argparse.Namespace) -> None:
    """Output a service's type."""
    with command_node() as node:
        name = node.resolve_service_name(options.service_name)
        settle(node, lambda: name in dict(node.get_service_names_and_types()))
        types = dict(node.get_service_names_and_types()).get(name)
    if types is None:
        raise CliError(f"Unknown service '{options.service_name}'")
    print("\n".join(types))


def _define_call(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("service_name")
    parser.add_argument("service_type", help="as in std_srvs/srv/Trigger")
    parser.add_argument("values", nargs="?", help="fields of the request in YAML")


def _call(options: argparse.Namespace) -> None:
    """Call a service."""
    kind = interface(options.service_type, "srv")
    request = filled(kind.Request, options.values)
    with command_node() as node:
        client = node.create_client(kind, options.service_name)
        if not client.wait_for_service(0.2):
            _refuse_other_type(node, client.service_name, options.service_type)
            print("waiting for service to become available...", file=sys.stderr, flush=True)
            client.wait_for_service()
        print(f"requester: making request: {request!r}\n", flush=True)
        response = spin_until(node, client.call_async(request))
    print(f"response:\n{response!r}\n")


def _refuse_other_type(node: object, name: str, wanted: str) -> None:
    """Says so if the service is there with another type: it would never answer."""
    settle(node)  # type: ignore[arg-type]
    offered = [
        node_entry
        for node_entry in node.context.graph.endpoints()  # type: ignore[attr-defined]
        if not node_entry.writer and node_entry.topic == f"rq{name}Request"
    ]
    types = {endpoint.type for endpoint in offered}
    short = wanted.split("/")[-1]
    if types and not any(kind.endswith(f"::{short}_Request_") for kind in types):
        raise CliError(
            f"The service '{name}' is not of type {wanted} but {', '.join(sorted(types))}"
        )


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 service ...`."""
    verbs = {
        "list": (_define_list, _list),
        "type": (_define_type, _type),
        "call": (_define_call, _call),
    }
    return run("service", "Various service related commands.", verbs, arguments)
