"""`ros2 service call`."""

from __future__ import annotations

import argparse
import time

import rclpy
import yaml

from ros2_embedded.cli import interfaces
from ros2_embedded.cli.command_node import PREFIX, await_peer, bare_node, spin_until
from ros2_embedded.cli.common import CliError, finite, given_values, option, values_options
from ros2_embedded.message_values import fill

OPTIONS = (
    option("service_name", help="Name of the ROS service to call to (e.g. '/add_two_ints')"),
    option("service_type", help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')"),
    values_options("values", "Values to fill the service request with in YAML format (e.g. '{a: "
                   "1, b: 2}'), otherwise the service request will be published with default "
                   "values"),
    option("-r", "--rate", metavar="N", type=finite,
           help="Repeat the call at a specific rate in Hz"),
)  # fmt: skip


def call(options: argparse.Namespace) -> str | None:
    """Calls the service, once or until Ctrl-C; returns what went wrong."""
    if options.rate is not None and options.rate <= 0:
        raise CliError("rate must be greater than zero")
    text = given_values(options, "values")
    kind = interfaces.find(options.service_type, "srv", "The passed service type is invalid")
    request = kind.Request()
    try:
        fill(request, yaml.safe_load(text))
    except Exception as error:  # whatever a value does to a field, as in ROS 2
        return f"Failed to populate field: {error}"
    package, *_, short = options.service_type.split("/")
    with bare_node(f"{PREFIX}_requester_{package}_{short}") as node:
        client = node.create_client(kind, options.service_name)
        if not client.service_is_ready():
            print("waiting for service to become available...")
            await_peer(client.wait_for_service)
        while True:
            print(f"requester: making request: {request!r}\n")
            called = time.monotonic()
            print(f"response:\n{spin_until(node, client.call_async(request))!r}\n")
            if options.rate is None or not rclpy.ok():
                return None
            time.sleep(max(0.0, called + 1.0 / options.rate - time.monotonic()))
