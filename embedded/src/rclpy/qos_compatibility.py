"""Whether a publisher and a subscription can talk."""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum
from typing import Any

_VAGUE = ("system_default", "unknown")


class QoSCompatibility(IntEnum):
    """Whether two profiles are compatible: yes, perhaps not, no."""

    OK = 0
    WARNING = 1
    ERROR = 2


def _longer(offered: Any, wanted: Any) -> bool:
    """Whether both durations are given, and the wanted one is shorter than the offered one."""
    return 0 < wanted.nanoseconds < offered.nanoseconds


def _errors(publisher: Any, subscription: Any) -> Iterator[str]:
    def pair(policy: str) -> tuple[str, str]:
        return getattr(publisher, policy).short_key, getattr(subscription, policy).short_key

    if pair("reliability") == ("best_effort", "reliable"):
        yield "Best effort publisher and reliable subscription"
    if pair("durability") == ("volatile", "transient_local"):
        yield "Volatile publisher and transient local subscription"
    offered, wanted = publisher.deadline, subscription.deadline
    if wanted.nanoseconds and not offered.nanoseconds:
        yield "Subscription has a deadline, but publisher does not"
    if _longer(offered, wanted):
        yield "Subscription deadline is less than publisher deadline"
    if pair("liveliness") == ("automatic", "manual_by_topic"):
        yield "Publisher's liveliness is automatic and subscription's is manual by topic"
    offered = publisher.liveliness_lease_duration
    wanted = subscription.liveliness_lease_duration
    if wanted.nanoseconds and not offered.nanoseconds:
        yield "Subscription has a liveliness lease duration, but publisher does not"
    if _longer(offered, wanted):
        yield "Subscription liveliness lease duration is less than publisher"


def _warnings(publisher: Any, subscription: Any) -> Iterator[str]:
    """Reasons for a warning: a policy that only the middleware knows meets a strict one."""
    for policy, word, strict, lax, texts in (
        ("reliability", "reliability", "reliable", "best_effort",
         ("Reliable subscription, but publisher is {}",
          "Best effort publisher, but subscription is {}")),
        ("durability", "durabilty", "transient_local", "volatile",
         ("Transient local subscription, but publisher is {}",
          "Volatile publisher, but subscription is {}")),
        ("liveliness", "liveliness", "manual_by_topic", "automatic",
         ("Subscription's liveliness is manual by topic, but publisher's is {}",
          "Publisher's liveliness is automatic, but subscription's is {}")),
    ):  # fmt: skip
        offered = getattr(publisher, policy).short_key
        wanted = getattr(subscription, policy).short_key
        if offered in _VAGUE and wanted in _VAGUE:
            yield f"Publisher {word} is {offered} and subscription {policy} is {wanted}"
        elif offered in _VAGUE and wanted == strict:
            yield texts[0].format(offered)
        elif offered == lax and wanted in _VAGUE:
            yield texts[1].format(wanted)


def qos_check_compatible(publisher_qos: Any, subscription_qos: Any) -> tuple[QoSCompatibility, str]:
    """Whether two profiles fit, and every reason why they do not."""
    for level, find in ((QoSCompatibility.ERROR, _errors), (QoSCompatibility.WARNING, _warnings)):
        reasons = [f"{level.name}: {text};" for text in find(publisher_qos, subscription_qos)]
        if reasons:
            return level, "".join(reasons)
    return QoSCompatibility.OK, ""
