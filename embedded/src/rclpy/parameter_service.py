"""The services through which `ros2 param` reads and sets a node's parameters."""

from __future__ import annotations

from typing import Any

from ros2_embedded.message_modules import service_class
from ros2_embedded.messages import message_class

from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter
from rclpy.parameter_store import ParameterStore
from rclpy.qos import qos_profile_parameters


class ParameterService:
    """Six services below the node's name."""

    def __init__(self, node: Any, store: ParameterStore) -> None:
        """Starts them."""
        self._store = store
        for name, handler in {
            "DescribeParameters": self._describe,
            "GetParameterTypes": self._types,
            "GetParameters": self._get,
            "ListParameters": self._list,
            "SetParameters": self._set,
            "SetParametersAtomically": self._set_atomically,
        }.items():
            snake = "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")
            kind = service_class(f"rcl_interfaces/srv/{name}")
            node.create_service(kind, f"~/{snake}", handler, qos_profile=qos_profile_parameters)

    def _describe(self, request: Any, response: Any) -> Any:
        if all(name in self._store.descriptors for name in request.names):
            found = []
            for name in request.names:
                descriptor = self._store.descriptors[name]
                descriptor.type = int(self._store.parameters[name].type_)
                found.append(descriptor)
            response.descriptors = found
        return response

    def _types(self, request: Any, response: Any) -> Any:
        if all(name in self._store.parameters for name in request.names):
            response.types = [int(self._store.parameters[name].type_) for name in request.names]
        return response

    def _get(self, request: Any, response: Any) -> Any:
        if all(name in self._store.parameters for name in request.names):
            found = [self._store.parameters[name] for name in request.names]
            response.values = [parameter.get_parameter_value() for parameter in found]
        return response

    def _list(self, request: Any, response: Any) -> Any:
        prefixes = [f"{prefix}." for prefix in request.prefixes]
        names, groups = [], set()
        for name in sorted(self._store.parameters):
            below = not prefixes or any(name.startswith(prefix) for prefix in prefixes)
            if below and (not request.depth or name.count(".") < request.depth):
                names.append(name)
                if "." in name:
                    groups.add(name.rpartition(".")[0])
        response.result.names, response.result.prefixes = names, sorted(groups)
        return response

    def _set_all(self, messages: list[Any]) -> Any:
        try:
            return self._store.set_atomically([Parameter.from_parameter_msg(m) for m in messages])
        except ParameterNotDeclaredException as error:
            result = message_class("rcl_interfaces/msg/SetParametersResult")
            return result(successful=False, reason=str(error))

    def _set(self, request: Any, response: Any) -> Any:
        response.results = [self._set_all([message]) for message in request.parameters]
        return response

    def _set_atomically(self, request: Any, response: Any) -> Any:
        response.result = self._set_all(list(request.parameters))
        return response
