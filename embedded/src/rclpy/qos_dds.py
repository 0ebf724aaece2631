"""Quality of service on the wire: rclpy's profile and Cyclone DDS's policies."""

from __future__ import annotations

from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.util import duration

from rclpy.duration import Duration
from rclpy.exceptions import RCLError
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

_INFINITE = duration(infinite=True)


def to_dds(profile: QoSProfile, user_data: str, writer: bool) -> Qos:
    """The policies of a writer or a reader, as rmw_cyclonedds_cpp sets them.

    Raises:
        RCLError: A policy is UNKNOWN.
    """
    named = (profile.history, profile.reliability, profile.durability, profile.liveliness)
    if any(policy.short_key == "unknown" for policy in named):
        raise RCLError(f"Failed to create an endpoint: a policy is unknown in {profile}")
    history: Any = Policy.History.KeepAll
    if not profile.keep_all:
        history = Policy.History.KeepLast(max(profile.depth, 1))
    policies: list[Any] = [
        history,
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(user_data.encode("ascii")),
        Policy.Reliability.BestEffort
        if profile.reliability.short_key == "best_effort"
        else Policy.Reliability.Reliable(_INFINITE),
    ]
    if profile.durability.short_key == "transient_local":
        policies.append(Policy.Durability.TransientLocal)
        # For late readers, Cyclone DDS uses the depth of this policy, not that of the history.
        policies.append(Policy.DurabilityService(0, history, -1, -1, -1))
    else:
        policies.append(Policy.Durability.Volatile)
    if writer:
        policies.append(Policy.WriterDataLifecycle(autodispose=False))
    return Qos(*policies, *_times(profile))


def _times(profile: QoSProfile) -> list[Any]:
    policies: list[Any] = []
    if profile.lifespan.nanoseconds:
        policies.append(Policy.Lifespan(profile.lifespan.nanoseconds))
    if profile.deadline.nanoseconds:
        policies.append(Policy.Deadline(profile.deadline.nanoseconds))
    lease = profile.liveliness_lease_duration.nanoseconds or _INFINITE
    if profile.liveliness.short_key == "manual_by_topic":
        policies.append(Policy.Liveliness.ManualByTopic(lease))
    elif lease != _INFINITE:
        policies.append(Policy.Liveliness.Automatic(lease))
    return policies


def from_dds(qos: Qos) -> QoSProfile:
    """The profile of an endpoint that was found in the domain."""
    history = qos[Policy.History] if Policy.History in qos else Policy.History.KeepLast(1)
    keep_all = history == Policy.History.KeepAll
    best_effort = qos[Policy.Reliability] == Policy.Reliability.BestEffort
    durabilities = {
        Policy.Durability.TransientLocal: DurabilityPolicy.TRANSIENT_LOCAL,
        Policy.Durability.Volatile: DurabilityPolicy.VOLATILE,
    }
    automatic = Policy.Liveliness.Automatic(_INFINITE)
    has_liveliness = Policy.Liveliness in qos
    liveliness = qos[Policy.Liveliness] if has_liveliness else automatic
    kinds = {
        Policy.Liveliness.Automatic: LivelinessPolicy.AUTOMATIC,
        Policy.Liveliness.ManualByTopic: LivelinessPolicy.MANUAL_BY_TOPIC,
    }
    deadline = qos[Policy.Deadline].deadline if Policy.Deadline in qos else _INFINITE
    lifespan = qos[Policy.Lifespan].lifespan if Policy.Lifespan in qos else _INFINITE
    return QoSProfile(
        depth=0 if keep_all else history.depth,
        history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=durabilities.get(qos[Policy.Durability], DurabilityPolicy.UNKNOWN),
        lifespan=Duration(nanoseconds=lifespan),
        deadline=Duration(nanoseconds=deadline),
        liveliness=kinds.get(type(liveliness), LivelinessPolicy.UNKNOWN),
        liveliness_lease_duration=Duration(nanoseconds=liveliness.lease_duration),
    )
