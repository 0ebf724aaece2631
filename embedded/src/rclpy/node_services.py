"""The parts that every node has: parameters, their events and services, time, `/rosout`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.logging_service import start_logging_service
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService
from rclpy.parameter_store import ParameterStore, new_descriptor
from rclpy.qos import qos_profile_parameter_events
from rclpy.rosout import Rosout
from rclpy.time_source import TimeSource
from rclpy.type_description_service import start_type_description_service


def start_node_services(
    node: Any,
    *,
    overrides: Sequence[Parameter],
    rosout: bool,
    parameter_services: bool,
    logger_service: bool,
    allow_undeclared: bool,
    declare_overrides: bool,
) -> None:
    """Sets up a node that has its handle, in rclpy's order."""
    handle = node.handle
    if rosout and handle.context.arguments.flags.get("rosout", True):
        handle.services.append(Rosout(node))
    events = node.create_publisher(
        message_class("rcl_interfaces/msg/ParameterEvent"),
        "/parameter_events",
        qos_profile_parameter_events,
    )
    values = {name: Parameter(name, value=value) for name, value in handle.overrides().items()}
    values.update({parameter.name: parameter for parameter in overrides})
    handle.parameters = ParameterStore(
        values, allow_undeclared, lambda *changes: events.publish(_event(node, *changes))
    )
    if declare_overrides:
        node.declare_parameters(
            "",
            [(name, parameter.value, new_descriptor()) for name, parameter in values.items()],
            ignore_override=True,
        )
    handle.services.append(TimeSource(node))
    if parameter_services:
        ParameterService(node)
    if logger_service:
        start_logging_service(node)
    start_type_description_service(node)


def _event(
    node: Any, new: list[Parameter], changed: list[Parameter], deleted: list[Parameter]
) -> Any:
    return message_class("rcl_interfaces/msg/ParameterEvent")(
        stamp=node.get_clock().now().to_msg(),
        node=node.get_fully_qualified_name(),
        new_parameters=[parameter.to_parameter_msg() for parameter in new],
        changed_parameters=[parameter.to_parameter_msg() for parameter in changed],
        deleted_parameters=[parameter.to_parameter_msg() for parameter in deleted],
    )
