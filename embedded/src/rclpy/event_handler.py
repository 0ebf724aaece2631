"""Events of publishers and subscriptions: endpoints that fit or do not, deadlines, liveliness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

from cyclonedds.core import DDSStatus
from ros2_embedded.status import Sinks, changes_of

from rclpy.entity import Entity
from rclpy.exceptions import UnsupportedEventTypeError as UnsupportedEventTypeError
from rclpy.qos import QoSPolicyKind, qos_policy_name_from_kind
from rclpy.weak_method import weakly

_POLICY_KINDS = {
    2: QoSPolicyKind.DURABILITY,
    4: QoSPolicyKind.DEADLINE,
    8: QoSPolicyKind.LIVELINESS,
    11: QoSPolicyKind.RELIABILITY,
    13: QoSPolicyKind.HISTORY,
    21: QoSPolicyKind.LIFESPAN,
}
"""By the number that the policy has in DDS."""


@dataclass(frozen=True)
class _Counts:
    total_count: int
    total_count_change: int


class IncompatibleTypeInfo(_Counts):
    """Number of endpoints of another type; always 0, as with rmw_cyclonedds_cpp."""


class QoSRequestedDeadlineMissedInfo(_Counts):
    """Number of missed deadlines of a subscription."""


class QoSOfferedDeadlineMissedInfo(_Counts):
    """Number of missed deadlines of a publisher."""


class QoSLivelinessLostInfo(_Counts):
    """Number of times that a publisher lost its liveliness."""


class QoSMessageLostInfo(_Counts):
    """How many messages were lost."""


@dataclass(frozen=True)
class QoSLivelinessChangedInfo:
    """How many publishers of a subscription are alive."""

    alive_count: int
    not_alive_count: int
    alive_count_change: int
    not_alive_count_change: int


@dataclass(frozen=True)
class QoSRequestedIncompatibleQoSInfo(_Counts):
    """Number of endpoints with incompatible QoS, and the incompatible policy of the last one."""

    last_policy_kind: int


@dataclass(frozen=True)
class QoSPublisherMatchedInfo(_Counts):
    """Number of matched endpoints."""

    current_count: int
    current_count_change: int


QoSOfferedIncompatibleQoSInfo = QoSRequestedIncompatibleQoSInfo
QoSSubscriptionMatchedInfo = QoSPublisherMatchedInfo


def _info(kind: Any, status: Any) -> Any:
    """Converts the status of DDS to the argument of a callback."""
    values = {}
    for field in fields(kind):
        if field.name == "last_policy_kind":
            policy = _POLICY_KINDS.get(status.last_policy_id, QoSPolicyKind.INVALID)
            values[field.name] = int(policy)
        else:
            values[field.name] = getattr(status, field.name)
    return kind(**values)


class EventHandler(Entity):
    """Calls a function at each change of a status."""

    def __init__(self, node: Any, group: Any, callback: Callable[[Any], Any], kind: Any) -> None:
        """Made by publishers and subscriptions; `kind` is the class of the function's argument."""
        super().__init__(node, group, 0)
        self.callback, self._kind = callback, kind

    def note(self, status: Any) -> None:
        """Receives a status from the background thread; a mismatch of types is no event of QoS."""
        info = _info(self._kind, status)
        if getattr(info, "last_policy_kind", None) != QoSPolicyKind.INVALID:
            self.receive([info])

    def handle(self, sample: Any) -> Any:
        """Calls the function."""
        return self.callback(sample)

    def destroy(self) -> None:
        """Ends it: no callback comes afterwards."""
        self._inbox.clear()


Event = tuple[int, Callable[[Any], Any] | None, Any]
"""Bit of the status, function and class of what it gets."""


class SubscriptionEventCallbacks:
    """The functions that a subscription calls at its events."""

    def __init__(
        self,
        *,
        deadline: Callable[[QoSRequestedDeadlineMissedInfo], None] | None = None,
        incompatible_qos: Callable[[QoSRequestedIncompatibleQoSInfo], None] | None = None,
        liveliness: Callable[[QoSLivelinessChangedInfo], None] | None = None,
        message_lost: Callable[[QoSMessageLostInfo], None] | None = None,
        incompatible_type: Callable[[IncompatibleTypeInfo], None] | None = None,
        matched: Callable[[QoSSubscriptionMatchedInfo], None] | None = None,
        use_default_callbacks: bool = True,
    ) -> None:
        """Without `incompatible_qos` a warning is logged, if `use_default_callbacks`."""
        self.deadline, self.liveliness, self.matched = deadline, liveliness, matched
        self.incompatible_qos, self.incompatible_type = incompatible_qos, incompatible_type
        self.message_lost = message_lost
        self.use_default_callbacks = use_default_callbacks

    def events(self, node: Any, topic: str) -> list[Event]:
        """The events, with a function or None."""

        def warn(event: QoSRequestedIncompatibleQoSInfo) -> None:
            node.get_logger().warning(
                f"New publisher discovered on topic '{topic}', offering incompatible QoS. "
                "No messages will be received from it. "
                f"Last incompatible policy: {qos_policy_name_from_kind(event.last_policy_kind)}"
            )

        misfit = self.incompatible_qos or (warn if self.use_default_callbacks else None)
        return [
            (DDSStatus.RequestedDeadlineMissed, self.deadline, QoSRequestedDeadlineMissedInfo),
            (DDSStatus.RequestedIncompatibleQos, misfit, QoSRequestedIncompatibleQoSInfo),
            (DDSStatus.LivelinessChanged, self.liveliness, QoSLivelinessChangedInfo),
            (DDSStatus.SampleLost, self.message_lost, QoSMessageLostInfo),
            (DDSStatus.SubscriptionMatched, self.matched, QoSSubscriptionMatchedInfo),
        ]


class PublisherEventCallbacks:
    """The functions that a publisher calls at its events."""

    def __init__(
        self,
        *,
        deadline: Callable[[QoSOfferedDeadlineMissedInfo], None] | None = None,
        liveliness: Callable[[QoSLivelinessLostInfo], None] | None = None,
        incompatible_qos: Callable[[QoSOfferedIncompatibleQoSInfo], None] | None = None,
        incompatible_type: Callable[[IncompatibleTypeInfo], None] | None = None,
        matched: Callable[[QoSPublisherMatchedInfo], None] | None = None,
        use_default_callbacks: bool = True,
    ) -> None:
        """Without `incompatible_qos` a warning is logged, if `use_default_callbacks`."""
        self.deadline, self.liveliness, self.matched = deadline, liveliness, matched
        self.incompatible_qos, self.incompatible_type = incompatible_qos, incompatible_type
        self.use_default_callbacks = use_default_callbacks

    def events(self, node: Any, topic: str) -> list[Event]:
        """The events, with a function or None."""

        def warn(event: QoSOfferedIncompatibleQoSInfo) -> None:
            node.get_logger().warning(
                f"New subscription discovered on topic '{topic}', requesting incompatible QoS. "
                "No messages will be sent to it. "
                f"Last incompatible policy: {qos_policy_name_from_kind(event.last_policy_kind)}"
            )

        misfit = self.incompatible_qos or (warn if self.use_default_callbacks else None)
        return [
            (DDSStatus.OfferedDeadlineMissed, self.deadline, QoSOfferedDeadlineMissedInfo),
            (DDSStatus.LivelinessLost, self.liveliness, QoSLivelinessLostInfo),
            (DDSStatus.OfferedIncompatibleQos, misfit, QoSOfferedIncompatibleQoSInfo),
            (DDSStatus.PublicationMatched, self.matched, QoSPublisherMatchedInfo),
        ]


class EndpointEvents:
    """The event handlers of one publisher or subscription."""

    def __init__(self, node: Any, group: Any, endpoint: Any, events: list[Event]) -> None:
        """Has the status of `endpoint` watched where an event has a function."""
        self._node, self._endpoint = node, endpoint
        self.handlers: list[EventHandler] = []
        sinks: Sinks = {}
        for status, callback, kind in events:
            if callback is not None:
                handler = EventHandler(node, group, callback, kind)
                self.handlers.append(handler)
                sinks[status] = weakly(handler.note)
        if sinks:
            background = node.context.background
            self._end = background.call_when_gone(self, partial(background.remove, endpoint))
            node.handle.entities.extend(self.handlers)
            background.add(changes_of(endpoint, sinks), at_once=True)

    def release(self) -> None:
        """Ends them: no callback comes afterwards."""
        if self.handlers:
            self._end.detach()
            if (background := self._node.context.background) is not None:
                background.remove(self._endpoint)
        entities = self._node.handle.entities
        for handler in self.handlers:
            if handler in entities:
                entities.remove(handler)
            handler.destroy()
        self.handlers, self._endpoint = [], None
