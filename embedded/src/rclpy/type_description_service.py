"""The service that describes the types which a node uses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ros2_embedded.catalogue import message_spec
from ros2_embedded.message_modules import service_class
from ros2_embedded.messages import full_type_name, message_class
from ros2_embedded.typehash import description, type_hash

from rclpy.parameter import Parameter
from rclpy.parameter_store import new_descriptor
from rclpy.type_hash import TypeHash

START_TYPE_DESCRIPTION_SERVICE_PARAM = "start_type_description_service"
_PACKAGE = "type_description_interfaces"


def start_type_description_service(node: Any) -> None:
    """Starts it, unless the parameter `start_type_description_service` is false."""
    name = START_TYPE_DESCRIPTION_SERVICE_PARAM
    if not node.has_parameter(name):
        text = "If enabled, start the ~/get_type_description service."
        node.declare_parameter(name, True, new_descriptor(description=text, read_only=True))
    parameter = node.get_parameter(name)
    if parameter.type_ is not Parameter.Type.BOOL:
        node.get_logger().error(
            f"Invalid type for parameter '{name}' {parameter.type_!r} should be bool"
        )
    elif parameter.value:
        kind = service_class(f"{_PACKAGE}/srv/GetTypeDescription")
        topic = f"{node.get_name()}/get_type_description"

        def answer(request: Any, response: Any) -> Any:
            _fill(node, request, response)
            return response

        node.create_service(kind, topic, answer)


def _types(node: Any) -> Iterator[str]:
    """The types that a node uses."""
    for endpoint in (*node.publishers, *node.subscriptions):
        yield full_type_name(endpoint.msg_type)
    for endpoint in (*node.services, *node.clients):
        yield full_type_name(endpoint.srv_type.Request).removesuffix("_Request")


def _fill(node: Any, request: Any, response: Any) -> None:
    response.successful = False
    if str(TypeHash.from_text(request.type_hash)) == "INVALID":
        response.failure_reason = "Failed to parse type hash"
        return
    found = next((name for name in _types(node) if type_hash(name) == request.type_hash), None)
    if found is None:
        response.failure_reason = "Type not currently in use by this node"
        return
    whole = description(found)
    parts = [whole["type_description"], *whole["referenced_type_descriptions"]]
    individual = [_individual(part) for part in parts]
    response.type_description = message_class(f"{_PACKAGE}/msg/TypeDescription")(
        type_description=individual[0], referenced_type_descriptions=individual[1:]
    )
    if request.include_type_sources:
        response.type_sources = [_source(part["type_name"]) for part in parts]
    response.successful = True


def _individual(part: dict[str, Any]) -> Any:
    field, kind = (message_class(f"{_PACKAGE}/msg/{name}") for name in ("Field", "FieldType"))
    return message_class(f"{_PACKAGE}/msg/IndividualTypeDescription")(
        type_name=part["type_name"],
        fields=[field(name=item["name"], type=kind(**item["type"])) for item in part["fields"]],
    )


def _source(name: str) -> Any:
    """The definition, where it is there as text."""
    text = message_spec(name).text
    return message_class(f"{_PACKAGE}/msg/TypeSource")(
        type_name=name, encoding=name.split("/")[1] if text else "implicit", raw_file_contents=text
    )
