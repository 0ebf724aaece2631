"""Quality of service of topics and services."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.util import duration


class ReliabilityPolicy(IntEnum):
    """Whether lost samples are sent again."""

    SYSTEM_DEFAULT = 0
    RELIABLE = 1
    BEST_EFFORT = 2
    UNKNOWN = 3


class DurabilityPolicy(IntEnum):
    """Whether late subscribers get what was published before."""

    SYSTEM_DEFAULT = 0
    TRANSIENT_LOCAL = 1
    VOLATILE = 2
    UNKNOWN = 3


class HistoryPolicy(IntEnum):
    """How many samples are kept."""

    SYSTEM_DEFAULT = 0
    KEEP_LAST = 1
    KEEP_ALL = 2
    UNKNOWN = 3


class LivelinessPolicy(IntEnum):
    """Who says that a publisher is alive: here always the middleware."""

    SYSTEM_DEFAULT = 0
    AUTOMATIC = 1
    MANUAL_BY_TOPIC = 3
    UNKNOWN = 4


QoSReliabilityPolicy = ReliabilityPolicy
QoSDurabilityPolicy = DurabilityPolicy
QoSHistoryPolicy = HistoryPolicy
QoSLivelinessPolicy = LivelinessPolicy


class InvalidQoSProfileException(Exception):
    """A profile that makes no sense."""


class QoSProfile:
    """Reliability, durability and history of a publisher or a subscription."""

    def __init__(
        self,
        *,
        depth: int | None = None,
        history: HistoryPolicy | None = None,
        reliability: ReliabilityPolicy = ReliabilityPolicy.RELIABLE,
        durability: DurabilityPolicy = DurabilityPolicy.VOLATILE,
        liveliness: LivelinessPolicy = LivelinessPolicy.AUTOMATIC,
    ) -> None:
        """Takes the policies.

        Raises:
            InvalidQoSProfileException: neither a depth nor a history, or a depth under 1.
        """
        if history is None:
            if depth is None:
                raise InvalidQoSProfileException("History and/or depth settings are required.")
            history = HistoryPolicy.KEEP_LAST
        if history == HistoryPolicy.KEEP_LAST and depth is None:
            raise InvalidQoSProfileException("History set to KEEP_LAST without a depth setting.")
        if depth is not None and depth < 0:
            raise InvalidQoSProfileException(f"A depth cannot be negative: {depth}")
        self.history, self.depth = history, depth or (1 if depth == 0 else 0)
        self.reliability, self.durability = reliability, durability
        self.liveliness = liveliness

    def __eq__(self, other: object) -> bool:
        """The same policies."""
        return isinstance(other, QoSProfile) and vars(self) == vars(other)

    def __repr__(self) -> str:
        """The policies."""
        return (
            f"QoSProfile(depth={self.depth}, history={self.history.name}, "
            f"reliability={self.reliability.name}, durability={self.durability.name})"
        )

    @property
    def keep_all(self) -> bool:
        """Whether every sample is kept."""
        return self.history == HistoryPolicy.KEEP_ALL

    def to_dds(self, user_data: str, writer: bool) -> Qos:
        """As Cyclone DDS's QoS, in the way of rmw_cyclonedds_cpp."""
        history = Policy.History.KeepAll
        if not self.keep_all:
            history = Policy.History.KeepLast(max(self.depth, 1))
        policies: list[Any] = [
            history,
            Policy.DataRepresentation(use_cdrv0_representation=True),
            Policy.Userdata(user_data.encode("ascii")),
            Policy.Reliability.BestEffort
            if self.reliability == ReliabilityPolicy.BEST_EFFORT
            else Policy.Reliability.Reliable(duration(infinite=True)),
        ]
        if self.durability == DurabilityPolicy.TRANSIENT_LOCAL:
            policies.append(Policy.Durability.TransientLocal)
            # Cyclone DDS keeps for late readers what this policy says, not what the history says.
            policies.append(Policy.DurabilityService(0, history, -1, -1, -1))
        else:
            policies.append(Policy.Durability.Volatile)
        if writer:
            policies.append(Policy.WriterDataLifecycle(autodispose=False))
        return Qos(*policies)

    @classmethod
    def from_dds(cls, qos: Qos) -> QoSProfile:
        """The profile of an endpoint that was found in the domain."""
        history = qos[Policy.History] if Policy.History in qos else Policy.History.KeepLast(1)
        keep_all = history == Policy.History.KeepAll
        reliability, durability = ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE
        if qos[Policy.Reliability] == Policy.Reliability.BestEffort:
            reliability = ReliabilityPolicy.BEST_EFFORT
        if qos[Policy.Durability] == Policy.Durability.TransientLocal:
            durability = DurabilityPolicy.TRANSIENT_LOCAL
        return cls(
            depth=0 if keep_all else history.depth,
            history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
            reliability=reliability,
            durability=durability,
        )


qos_profile_default = QoSProfile(depth=10)
qos_profile_system_default = QoSProfile(depth=1)
qos_profile_services_default = QoSProfile(depth=10)
qos_profile_parameters = QoSProfile(depth=1000)
qos_profile_sensor_data = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
qos_profile_action_status_default = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
qos_profile_clock = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


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
            raise ValueError(f"History depth must be greater than or equal to zero, not {qos}")
        return QoSProfile(depth=qos)
    raise TypeError(f"Expected QoSProfile or int, not {qos!r}")
