"""Callbacks for changes of parameters of any node."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import ParameterEvent

from rclpy.qos import QoSProfile, qos_profile_parameter_events


@dataclass(frozen=True, eq=False)
class ParameterCallbackHandle:
    """A registered callback for one parameter; `node_name` is the full name of the node."""

    parameter_name: str
    node_name: str
    callback: Callable[[Any], Any]


@dataclass(frozen=True, eq=False)
class ParameterEventCallbackHandle:
    """A registered callback for all events."""

    callback: Callable[[Any], Any]


class ParameterEventHandler:
    """Calls functions when a parameter is declared or changed, the one that was added last first.

    A function for one parameter receives a Parameter message, one for events a ParameterEvent.
    """

    def __init__(
        self, node: Any, qos_profile: QoSProfile = qos_profile_parameter_events, **options: Any
    ) -> None:
        """Subscribes to `/parameter_events`; options are those of `Node.create_subscription`."""
        self.node, self.qos_profile = node, qos_profile
        # Changed only by a new list: a callback may add and remove others.
        self._handles: list[ParameterCallbackHandle | ParameterEventCallbackHandle] = []
        self.parameter_event_subscription = node.create_subscription(
            ParameterEvent, "/parameter_events", self._receive, qos_profile, **options
        )

    def destroy(self) -> None:
        """Ends the subscription."""
        self.node.destroy_subscription(self.parameter_event_subscription)

    def _receive(self, event: Any) -> None:
        handles = self._handles
        for handle in handles:
            if isinstance(handle, ParameterCallbackHandle):
                names = handle.parameter_name, handle.node_name
                if parameter := self.get_parameter_from_event(event, *names):
                    handle.callback(parameter)
        for handle in handles:
            if isinstance(handle, ParameterEventCallbackHandle):
                handle.callback(event)

    @staticmethod
    def get_parameter_from_event(event: Any, parameter_name: str, node_name: str) -> Any:
        """The Parameter message of one parameter of a node, or None if it has not changed."""
        found = ParameterEventHandler.get_parameters_from_event(event)
        return next((p for p in found if (p.name, event.node) == (parameter_name, node_name)), None)

    @staticmethod
    def get_parameters_from_event(event: Any) -> Iterator[Any]:
        """The Parameter messages of all parameters that were declared or changed."""
        yield from [*event.new_parameters, *event.changed_parameters]

    def add_parameter_callback(
        self, parameter_name: str, node_name: str, callback: Callable[[Any], Any]
    ) -> ParameterCallbackHandle:
        """Adds a callback for a parameter; a node name without `/` is in the node's namespace."""
        if not node_name:
            node_name = self.node.get_fully_qualified_name()
        elif not node_name.startswith("/"):
            node_name = f"{self.node.get_namespace().rstrip('/')}/{node_name}"
        handle = ParameterCallbackHandle(parameter_name, node_name, callback)
        self._handles = [handle, *self._handles]
        return handle

    def add_parameter_event_callback(
        self, callback: Callable[[Any], Any]
    ) -> ParameterEventCallbackHandle:
        """Adds a callback for the events of all nodes."""
        handle = ParameterEventCallbackHandle(callback)
        self._handles = [handle, *self._handles]
        return handle

    def remove_parameter_callback(self, handle: ParameterCallbackHandle) -> None:
        """Removes a callback.

        Raises:
            RuntimeError: The callback is not registered.
        """
        self._remove(handle)

    def remove_parameter_event_callback(self, handle: ParameterEventCallbackHandle) -> None:
        """Removes a callback.

        Raises:
            RuntimeError: The callback is not registered.
        """
        self._remove(handle)

    def _remove(self, handle: Any) -> None:
        if handle not in self._handles:
            raise RuntimeError("Callback doesn't exist")
        self._handles = [other for other in self._handles if other is not handle]
