"""Policies that are chosen to be compatible with the existing endpoints of a topic."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import (
    DeadlineBestAvailable,
    DurabilityPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)


def _is_open(profile: QoSProfile) -> bool:
    return (
        profile.reliability == ReliabilityPolicy.BEST_AVAILABLE
        or profile.durability == DurabilityPolicy.BEST_AVAILABLE
        or profile.liveliness == LivelinessPolicy.BEST_AVAILABLE
        or DeadlineBestAvailable in (profile.deadline, profile.liveliness_lease_duration)
    )


def _settle(profile: QoSProfile, policy: str, value: Any) -> None:
    if getattr(profile, policy).name == "BEST_AVAILABLE":
        setattr(profile, policy, value)


def _settle_times(profile: QoSProfile, others: list[QoSProfile], choose: Any) -> None:
    for policy in ("deadline", "liveliness_lease_duration"):
        if getattr(profile, policy) == DeadlineBestAvailable:
            lengths = (getattr(other, policy) for other in others)
            setattr(
                profile, policy, choose((d for d in lengths if d > Duration()), default=Duration())
            )


def _settle_liveliness(profile: QoSProfile, others: list[QoSProfile], choose: Any) -> None:
    manual = choose(other.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC for other in others)
    policy = LivelinessPolicy.MANUAL_BY_TOPIC if manual else LivelinessPolicy.AUTOMATIC
    _settle(profile, "liveliness", policy)


def for_subscription(profile: QoSProfile, find: Callable[[], list[QoSProfile]]) -> QoSProfile:
    """The profile, with its open policies as strict as all publishers allow."""
    if not _is_open(profile):
        return profile
    chosen, offers = copy.copy(profile), find()
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    _settle(
        chosen,
        "reliability",
        ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
    )
    _settle(
        chosen,
        "durability",
        DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
    _settle_liveliness(chosen, offers, all)
    _settle_times(chosen, offers, max)
    return chosen


def for_publisher(profile: QoSProfile, find: Callable[[], list[QoSProfile]]) -> QoSProfile:
    """The profile, with its open policies chosen to be compatible with all subscriptions."""
    if not _is_open(profile):
        return profile
    chosen, wishes = copy.copy(profile), find()
    _settle(chosen, "reliability", ReliabilityPolicy.RELIABLE)
    _settle(chosen, "durability", DurabilityPolicy.TRANSIENT_LOCAL)
    _settle_liveliness(chosen, wishes, any)
    _settle_times(chosen, wishes, min)
    return chosen
