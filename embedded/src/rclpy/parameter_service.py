"""The services through which `ros2 param` reads and sets a node's parameters."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from ros2_embedded.message_modules import service_class

from rclpy.exceptions import ParameterNotDeclaredException, ParameterUninitializedException
from rclpy.parameter import Parameter
from rclpy.parameter_store import set_result
from rclpy.qos import qos_profile_parameters


class ParameterService:
    """Six services below the node's name; a question about an unknown name has an empty answer."""

    def __init__(self, node: Any) -> None:
        """Starts them."""
        self._node = node
        for name, handler in {
            "DescribeParameters": self._describe,
            "GetParameters": self._get,
            "GetParameterTypes": self._types,
            "ListParameters": self._list,
            "SetParameters": self._set,
            "SetParametersAtomically": self._set_atomically,
        }.items():
            snake = "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")
            kind = service_class(f"rcl_interfaces/srv/{name}")
            topic = f"{node.get_name()}/{snake}"
            node.create_service(kind, topic, handler, qos_profile=qos_profile_parameters)

    def _describe(self, request: Any, response: Any) -> Any:
        with suppress(ParameterNotDeclaredException):
            response.descriptors = self._node.describe_parameters(request.names)
        return response

    def _get(self, request: Any, response: Any) -> Any:
        with suppress(ParameterNotDeclaredException, ParameterUninitializedException):
            found = self._node.get_parameters(request.names)
            response.values = [parameter.get_parameter_value() for parameter in found]
        return response

    def _types(self, request: Any, response: Any) -> Any:
        with suppress(ParameterNotDeclaredException):
            found = self._node.get_parameter_types(request.names)
            unset = Parameter.Type.NOT_SET
            response.types = [unset.value if kind is unset else kind for kind in found]
        return response

    def _list(self, request: Any, response: Any) -> Any:
        response.result = self._node.list_parameters(request.prefixes, request.depth)
        return response

    def _set_all(self, messages: list[Any]) -> Any:
        parameters = [Parameter.from_parameter_msg(message) for message in messages]
        try:
            return self._node.set_parameters_atomically(parameters)
        except ParameterNotDeclaredException as error:
            return set_result(str(error))

    def _set(self, request: Any, response: Any) -> Any:
        response.results = [self._set_all([message]) for message in request.parameters]
        return response

    def _set_atomically(self, request: Any, response: Any) -> Any:
        response.result = self._set_all(request.parameters)
        return response
