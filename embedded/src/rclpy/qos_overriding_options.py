"""Parameters with which the command line changes policies."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import IntEnum
from typing import Any

from rcl_interfaces.msg import SetParametersResult

from rclpy.duration import Duration
from rclpy.exceptions import ParameterAlreadyDeclaredException
from rclpy.parameter_store import new_descriptor
from rclpy.qos import QoSPolicyKind, QoSProfile

QosCallbackResult = SetParametersResult
QosCallbackType = Callable[[QoSProfile], Any]


class InvalidQosOverridesError(Exception):
    """A profile that the program's callback refuses."""


class QoSOverridingOptions:
    """Which policies have a parameter, and what checks the outcome."""

    def __init__(
        self,
        policy_kinds: Iterable[QoSPolicyKind],
        *,
        callback: QosCallbackType | None = None,
        entity_id: str | None = None,
    ) -> None:
        """`callback(profile)` returns a QosCallbackResult, `entity_id` goes into the names."""
        self.policy_kinds, self.callback, self.entity_id = policy_kinds, callback, entity_id

    @classmethod
    def with_default_policies(
        cls,
        *,
        callback: QosCallbackType | None = None,
        entity_id: str | None = None,
    ) -> QoSOverridingOptions:
        """Parameters for history, depth and reliability."""
        kinds = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)
        return cls(kinds, callback=callback, entity_id=entity_id)


def override_qos(
    node: Any, kind: str, topic: str, qos: QoSProfile, options: QoSOverridingOptions | None
) -> None:
    """Declares the parameters and changes the profile by them.

    Raises:
        InvalidQosOverridesError: the callback refuses the profile.
        RuntimeError: a parameter has a value that is no policy.
    """
    if options is None:
        return
    suffix = "" if options.entity_id is None else f"_{options.entity_id}"
    about = f"for {kind} `{topic}` with id `{options.entity_id}`"
    for policy in options.policy_kinds:
        if kind == "subscription" and policy == QoSPolicyKind.LIFESPAN:
            continue
        field = policy.name.lower()
        name = f"qos_overrides.{topic}.{kind}{suffix}.{field}"
        descriptor = new_descriptor(description=f"{field} {about}", read_only=True)
        try:
            parameter = node.declare_parameter(name, _as_value(getattr(qos, field)), descriptor)
        except ParameterAlreadyDeclaredException:
            parameter = node.get_parameter(name)
        setattr(qos, field, _as_policy(getattr(qos, field), field, parameter.value))
    result = options.callback(qos) if options.callback else None
    if result is not None and not result.successful:
        raise InvalidQosOverridesError(
            f"Provided QoS overrides {about}, are not valid: {result.reason}"
        )


def _as_value(policy: Any) -> Any:
    if isinstance(policy, IntEnum):
        if policy.name == "UNKNOWN":
            raise ValueError("User provided QoS profile is invalid")
        return policy.name.lower()
    return policy.nanoseconds if isinstance(policy, Duration) else policy


def _as_policy(default: Any, field: str, value: Any) -> Any:
    if isinstance(default, IntEnum):
        try:
            return type(default)[value.upper()]
        except KeyError:
            raise RuntimeError(f"Unexpected QoS override for policy `{field}`: `{value}`") from None
    return Duration(nanoseconds=value) if isinstance(default, Duration) else value
