"""`ros2 service`: list, type and call."""

from __future__ import annotations

import argparse
import time

from rclpy.node import Node

from ros2_commands.graph import Named, add_list, add_type, bare_node, result
from ros2_commands.messages import interface_class, message_from_yaml
from ros2_commands.options import Verbs, positive


def _services(node: Node) -> Named:
    return list(node.get_service_names_and_types())


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
    add_list(verbs, "services", _services)
    add_type(verbs, "service", _services)
    call = verbs.add("call", _call)
    call.add_argument("service_name")
    call.add_argument("service_type")
    call.add_argument("values", nargs="?", default="{}", help="request in YAML: '{data: true}'")
    call.add_argument("-r", "--rate", type=positive, metavar="N", help="repeat the call at N Hz")
