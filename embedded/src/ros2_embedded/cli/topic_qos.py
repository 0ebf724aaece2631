"""The quality of service that a command chooses for its subscription."""

from __future__ import annotations

import argparse
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ros2_embedded.cli.common import CliError, interface, settle

_RELIABILITIES = {
    "reliable": ReliabilityPolicy.RELIABLE,
    "best_effort": ReliabilityPolicy.BEST_EFFORT,
}
_DURABILITIES = {
    "volatile": DurabilityPolicy.VOLATILE,
    "transient_local": DurabilityPolicy.TRANSIENT_LOCAL,
}


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options."""
    parser.add_argument("--qos-depth", type=int, metavar="N", help="length of the queue")
    parser.add_argument("--qos-reliability", choices=_RELIABILITIES)
    parser.add_argument("--qos-durability", choices=_DURABILITIES)


def profile(options: argparse.Namespace, found: list[Any], default_depth: int = 10) -> QoSProfile:
    """The options' profile; without them the strictest that all of the publishers offer."""
    offered = [endpoint.qos_profile for endpoint in found]
    reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offered)
    latched = bool(offered) and all(
        qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offered
    )
    reliability = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(
        depth=options.qos_depth or default_depth,
        reliability=_RELIABILITIES.get(options.qos_reliability, reliability),
        durability=_DURABILITIES.get(options.qos_durability, durability),
    )


def discover(node: Node, name: str, type_name: str | None) -> tuple[Any, list[Any]]:
    """Class of a topic's messages and its publishers, as soon as one is there.

    Raises:
        CliError: the topic's type cannot be found out.
    """
    settle(node, lambda: node.count_publishers(name) > 0)
    publishers = node.get_publishers_info_by_topic(name)
    if type_name is None:
        types = dict(node.get_topic_names_and_types()).get(node.resolve_topic_name(name))
        if not types:
            raise CliError(f"WARNING: topic [{name}] does not appear to be published yet\n"
                           "Could not determine the type for the passed topic")  # fmt: skip
        if len(types) > 1:
            raise CliError(f"Cannot subscribe to '{name}': it has more than one type: {types}")
        type_name = types[0]
    return interface(type_name, "msg"), publishers
