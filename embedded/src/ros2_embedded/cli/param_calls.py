"""Calls of a node's parameter services, and how parameters look to the user."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python

from ros2_embedded.cli.command_node import spin_until
from ros2_embedded.cli.common import CliError
from ros2_embedded.message_modules import service_class

_PATIENCE = 5.0
"""Timeout for the parameter services of a node [s]."""


def call(node: Node, target: str, service: str, **fields: Any) -> Any:
    """Calls one of the parameter services of a node.

    Raises:
        CliError: The node's services do not exist.
    """
    kind = service_class(f"rcl_interfaces/srv/{service}")
    snake = "".join(f"_{c.lower()}" if c.isupper() else c for c in service).lstrip("_")
    client = node.create_client(kind, f"{target}/{snake}")
    try:
        if not client.wait_for_service(_PATIENCE):
            raise CliError(
                f"Wait for service timed out waiting for parameter services for node {target}"
            )
        return spin_until(node, client.call_async(kind.Request(**fields)))
    finally:
        node.destroy_client(client)


def names(node: Node, target: str, prefixes: list[str] | None = None) -> list[str]:
    """Names of a node's parameters, sorted."""
    response = call(node, target, "ListParameters", prefixes=prefixes or [])
    return sorted(response.result.names)


def values(node: Node, target: str, wanted: list[str]) -> list[Any]:
    """The values of a node's parameters as messages; empty if any of them is not declared."""
    return list(call(node, target, "GetParameters", names=wanted).values)


def describe(node: Node, target: str, wanted: list[str]) -> list[Any]:
    """Descriptors of a node's parameters."""
    return list(call(node, target, "DescribeParameters", names=wanted).descriptors)


def change(node: Node, target: str, parameters: list[Any]) -> list[Any]:
    """Sets parameters, which are messages; returns a result for each."""
    return list(call(node, target, "SetParameters", parameters=parameters).results)


def plain(value: Any) -> Any:
    """Python's value of a parameter; rows are lists."""
    found = parameter_value_to_python(value)
    return found if found is None or isinstance(found, (bool, int, float, str)) else list(found)


def type_name(number: int) -> str:
    """The type of a parameter as the user reads it: `double array`."""
    words = Parameter.Type(number).name.lower().replace("bool", "boolean")
    return words.replace("_", " ")
