"""Reading and setting the parameters of another node."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from ros2_embedded.message_modules import service_class
from ros2_embedded.messages import message_class

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.parameter import Parameter, parameter_dict_from_yaml_file
from rclpy.qos import QoSProfile, qos_profile_parameter_events, qos_profile_services_default
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription
from rclpy.task import Future

_POLL = 0.05
_SERVICES = {
    "GetParameters": "get_parameters",
    "ListParameters": "list_parameters",
    "SetParameters": "set_parameters",
    "GetParameterTypes": "get_parameter_types",
    "DescribeParameters": "describe_parameters",
    "SetParametersAtomically": "set_parameters_atomically",
}
Callback = Callable[[Future], Any] | None


class AsyncParameterClient:
    """Calls a node's parameter services; each call returns the future of the service's response."""

    def __init__(
        self,
        node: Any,
        remote_node_name: str,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> None:
        """Creates the clients."""
        self.node, self.remote_node_name = node, remote_node_name
        self._kinds = {name: service_class(f"rcl_interfaces/srv/{name}") for name in _SERVICES}
        self._clients = {
            name: node.create_client(
                self._kinds[name],
                f"{remote_node_name}/{service}",
                qos_profile=qos_profile,
                callback_group=callback_group,
            )
            for name, service in _SERVICES.items()
        }

    def services_are_ready(self) -> bool:
        """Whether all services are there."""
        return all(client.service_is_ready() for client in self._clients.values())

    def wait_for_services(self, timeout_sec: float | None = None) -> bool:
        """Waits for all services; False if they did not come in time."""
        deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
        while not self.services_are_ready():
            if deadline is not None and time.monotonic() >= deadline:
                return False
            time.sleep(_POLL)
        return True

    def _call(self, name: str, callback: Callback, **fields: Any) -> Future:
        future = self._clients[name].call_async(self._kinds[name].Request(**fields))
        if callback:
            future.add_done_callback(callback)
        return future

    def list_parameters(
        self,
        prefixes: list[str] | None = None,
        depth: int | None = None,
        callback: Callback = None,
    ) -> Future:
        """Lists parameters, those below the prefixes and to that depth if they are given."""
        return self._call("ListParameters", callback, prefixes=prefixes or [], depth=depth or 0)

    def get_parameters(self, names: list[str], callback: Callback = None) -> Future:
        """Gets the values of parameters."""
        return self._call("GetParameters", callback, names=names)

    def describe_parameters(self, names: list[str], callback: Callback = None) -> Future:
        """Gets the descriptors of parameters."""
        return self._call("DescribeParameters", callback, names=names)

    def get_parameter_types(self, names: list[str], callback: Callback = None) -> Future:
        """Gets the types of parameters."""
        return self._call("GetParameterTypes", callback, names=names)

    def set_parameters(self, parameters: Sequence[Any], callback: Callback = None) -> Future:
        """Sets parameters one by one; they may be messages."""
        return self._call("SetParameters", callback, parameters=_messages(parameters))

    def set_parameters_atomically(
        self, parameters: Sequence[Any], callback: Callback = None
    ) -> Future:
        """Sets all parameters or no parameter; they may be messages."""
        return self._call("SetParametersAtomically", callback, parameters=_messages(parameters))

    def delete_parameters(self, names: list[str], callback: Callback = None) -> Future:
        """Unsets parameters, which must be dynamically typed."""
        return self.set_parameters([Parameter(name) for name in names], callback)

    def load_parameter_file(
        self, parameter_file: str, use_wildcard: bool = False, callback: Callback = None
    ) -> Future:
        """Sets the parameters of a parameter file one by one."""
        found = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters(list(found.values()), callback)

    def load_parameter_file_atomically(
        self, parameter_file: str, use_wildcard: bool = False, callback: Callback = None
    ) -> Future:
        """Sets all parameters of a parameter file, or no parameter."""
        found = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters_atomically(list(found.values()), callback)

    def on_parameter_event(
        self,
        callback: Callable[..., Any],
        qos_profile: QoSProfile = qos_profile_parameter_events,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> Subscription:
        """Has `callback` called with the parameter events of all nodes."""
        return self.node.create_subscription(
            message_class("rcl_interfaces/msg/ParameterEvent"),
            "/parameter_events",
            callback,
            qos_profile,
            callback_group=callback_group,
            event_callbacks=event_callbacks,
            qos_overriding_options=qos_overriding_options,
            raw=raw,
        )


def _messages(parameters: Sequence[Any]) -> list[Any]:
    return [p.to_parameter_msg() if isinstance(p, Parameter) else p for p in parameters]
