"""Quality of service of topics and services."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from enum import Enum, IntEnum
from typing import Any

from rclpy.duration import Duration
from rclpy.qos_compatibility import QoSCompatibility as QoSCompatibility
from rclpy.qos_compatibility import qos_check_compatible as qos_check_compatible


class QoSPolicyKind(IntEnum):
    """The policies, as bits."""

    INVALID = 1 << 0
    DURABILITY = 1 << 1
    DEADLINE = 1 << 2
    LIVELINESS = 1 << 3
    RELIABILITY = 1 << 4
    HISTORY = 1 << 5
    LIFESPAN = 1 << 6
    DEPTH = 1 << 7
    LIVELINESS_LEASE_DURATION = 1 << 8
    AVOID_ROS_NAMESPACE_CONVENTIONS = 1 << 9


def qos_policy_name_from_kind(policy_kind: QoSPolicyKind | int) -> str:
    """Name of a policy."""
    return QoSPolicyKind(policy_kind).name


class QoSPolicyEnum(IntEnum):
    """Base of the policies: they have short names for the command line."""

    @classmethod
    def short_keys(cls) -> list[str]:
        """The short names."""
        return [name.lower() for name in cls.__members__]

    @classmethod
    def get_from_short_key(cls, name: str) -> int:
        """The value of a short name, in capitals or not."""
        return cls[name.upper()].value

    @property
    def short_key(self) -> str:
        """The short name."""
        return self.name.lower()


class ReliabilityPolicy(QoSPolicyEnum):
    """Whether lost samples are sent again."""

    SYSTEM_DEFAULT = 0
    RELIABLE = 1
    BEST_EFFORT = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4


class DurabilityPolicy(QoSPolicyEnum):
    """Whether late subscribers get what was published before."""

    SYSTEM_DEFAULT = 0
    TRANSIENT_LOCAL = 1
    VOLATILE = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4


class HistoryPolicy(QoSPolicyEnum):
    """How many samples are kept."""

    SYSTEM_DEFAULT = 0
    KEEP_LAST = 1
    KEEP_ALL = 2
    UNKNOWN = 3


class LivelinessPolicy(QoSPolicyEnum):
    """Who asserts that a publisher is alive: the middleware or the publisher."""

    SYSTEM_DEFAULT = 0
    AUTOMATIC = 1
    MANUAL_BY_TOPIC = 3
    UNKNOWN = 4
    BEST_AVAILABLE = 5


QoSReliabilityPolicy = ReliabilityPolicy
QoSDurabilityPolicy = DurabilityPolicy
QoSHistoryPolicy = HistoryPolicy
QoSLivelinessPolicy = LivelinessPolicy

_BEST_AVAILABLE_NS = (1 << 63) - 2
DeadlineBestAvailable = Duration(nanoseconds=_BEST_AVAILABLE_NS)
LivelinessLeaseDurationeBestAvailable = Duration(nanoseconds=_BEST_AVAILABLE_NS)


class InvalidQoSProfileException(Exception):
    """A profile that makes no sense."""

    def __init__(self, *args: Any) -> None:
        """Keeps the reason."""
        super().__init__("Invalid QoSProfile", *args)


def _instance(kind: type) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        assert isinstance(value, kind)
        return value

    return check


def _member(kind: type[IntEnum]) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        assert isinstance(value, int)
        return kind(value)

    return check


_CHECKS = {
    "history": _member(HistoryPolicy),
    "depth": _instance(int),
    "reliability": _member(ReliabilityPolicy),
    "durability": _member(DurabilityPolicy),
    "lifespan": _instance(Duration),
    "deadline": _instance(Duration),
    "liveliness": _member(LivelinessPolicy),
    "liveliness_lease_duration": _instance(Duration),
    "avoid_ros_namespace_conventions": _instance(bool),
}
_DEFAULTS = {
    "depth": 10,
    "reliability": ReliabilityPolicy.RELIABLE,
    "durability": DurabilityPolicy.VOLATILE,
    "lifespan": Duration(),
    "deadline": Duration(),
    "liveliness": LivelinessPolicy.SYSTEM_DEFAULT,
    "liveliness_lease_duration": Duration(),
    "avoid_ros_namespace_conventions": False,
}


class QoSProfile:
    """The policies of a publisher or a subscription; a duration of 0 means the default."""

    __slots__ = tuple(_CHECKS)

    history: HistoryPolicy
    depth: int
    reliability: ReliabilityPolicy
    durability: DurabilityPolicy
    lifespan: Duration
    deadline: Duration
    liveliness: LivelinessPolicy
    liveliness_lease_duration: Duration
    avoid_ros_namespace_conventions: bool

    def __init__(self, **kwargs: Any) -> None:
        """Sets the policies.

        Raises:
            InvalidQoSProfileException: Depth and history are missing, or KEEP_LAST lacks a depth.
            AssertionError: A policy is unknown, or its value has another type.
        """
        assert kwargs.keys() <= _CHECKS.keys(), (
            f"Invalid arguments passed to constructor: {kwargs.keys()!r}"
        )
        if "history" not in kwargs and "depth" not in kwargs:
            raise InvalidQoSProfileException("History and/or depth settings are required.")
        self.history = kwargs.get("history", HistoryPolicy.KEEP_LAST)
        if self.history == HistoryPolicy.KEEP_LAST and "depth" not in kwargs:
            raise InvalidQoSProfileException("History set to KEEP_LAST without a depth setting.")
        for name, default in _DEFAULTS.items():
            setattr(self, name, kwargs.get(name, default))

    def __setattr__(self, name: str, value: Any) -> None:
        """Checks a policy and sets it."""
        check = _CHECKS.get(name)
        checked = check(value) if check else value
        if name == "depth" and value == 0 and self.history == HistoryPolicy.KEEP_LAST:
            warnings.warn(
                "A zero depth with KEEP_LAST doesn't make sense; no data could be stored. "
                "This will be interpreted as SYSTEM_DEFAULT",
                stacklevel=2,
            )
        object.__setattr__(self, name, checked)

    def __eq__(self, other: object) -> bool:
        """Whether all policies are the same."""
        if not isinstance(other, QoSProfile):
            return False
        return all(getattr(self, name) == getattr(other, name) for name in _CHECKS)

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        """The policies."""
        policies = ", ".join(f"{name}={getattr(self, name)}" for name in _CHECKS)
        return f"{type(self).__name__}({policies})"

    @property
    def keep_all(self) -> bool:
        """Whether every sample is kept."""
        return self.history == HistoryPolicy.KEEP_ALL


qos_profile_unknown = QoSProfile(
    history=HistoryPolicy.UNKNOWN,
    depth=0,
    reliability=ReliabilityPolicy.UNKNOWN,
    durability=DurabilityPolicy.UNKNOWN,
    liveliness=LivelinessPolicy.UNKNOWN,
)
qos_profile_default = QoSProfile(depth=10)
qos_profile_system_default = QoSProfile(
    history=HistoryPolicy.SYSTEM_DEFAULT,
    depth=0,
    reliability=ReliabilityPolicy.SYSTEM_DEFAULT,
    durability=DurabilityPolicy.SYSTEM_DEFAULT,
)
qos_profile_sensor_data = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
qos_profile_services_default = QoSProfile(depth=10)
qos_profile_parameters = QoSProfile(depth=1000)
qos_profile_parameter_events = QoSProfile(depth=1000)
qos_profile_best_available = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.BEST_AVAILABLE,
    durability=DurabilityPolicy.BEST_AVAILABLE,
    deadline=DeadlineBestAvailable,
    liveliness=LivelinessPolicy.BEST_AVAILABLE,
    liveliness_lease_duration=LivelinessLeaseDurationeBestAvailable,
)
qos_profile_action_status_default = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class QoSPresetProfiles(Enum):
    """The profiles that have a name."""

    UNKNOWN = qos_profile_unknown
    DEFAULT = qos_profile_default
    SYSTEM_DEFAULT = qos_profile_system_default
    SENSOR_DATA = qos_profile_sensor_data
    SERVICES_DEFAULT = qos_profile_services_default
    PARAMETERS = qos_profile_parameters
    PARAMETER_EVENTS = qos_profile_parameter_events
    ACTION_STATUS_DEFAULT = qos_profile_action_status_default
    BEST_AVAILABLE = qos_profile_best_available

    @classmethod
    def short_keys(cls) -> list[str]:
        """The short names."""
        return [name.lower() for name in cls.__members__]

    @classmethod
    def get_from_short_key(cls, name: str) -> QoSProfile:
        """The profile of a short name, in capitals or not."""
        return cls[name.upper()].value


def as_profile(qos: QoSProfile | int) -> QoSProfile:
    """A profile, or the depth of the default one.

    Raises:
        TypeError: neither of the two.
        ValueError: a negative depth.
    """
    if isinstance(qos, QoSProfile):
        return qos
    if isinstance(qos, int):
        if qos < 0:
            raise ValueError("history depth must be greater than or equal to zero")
        return QoSProfile(depth=qos)
    raise TypeError(f"Expected QoSProfile or int, but received {type(qos)!r}")
