"""The quality of service that a command chooses for its publisher or subscription."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from copy import copy
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
)

from ros2_embedded.cli.common import Define, finite, option, whole

_OVERRIDES = ("reliability", "durability", "depth", "history", "liveliness",
              "liveliness_lease_duration_seconds")  # fmt: skip


def _preset(name: str) -> QoSProfile:
    """A profile of rclpy, to be changed."""
    return copy(QoSPresetProfiles.get_from_short_key(name))


def options(way: str, default: str) -> list[Define]:
    """The options; `way` is `subscribe` or `publish`, `default` is the name of the preset."""
    policies = {"reliability": ReliabilityPolicy, "durability": DurabilityPolicy}
    return [
        option("--qos-profile", choices=QoSPresetProfiles.short_keys(), default=default,
               help=f"Quality of service preset profile to {way} with (default: {default})"),
        option("--qos-depth", metavar="N", type=whole,
               help=f"Queue size setting to {way} with (overrides depth value of --qos-profile "
               "option)"),
        option("--qos-history", choices=HistoryPolicy.short_keys(),
               help=f"History of samples setting to {way} with (overrides history value of "
               f"--qos-profile option, default: {_preset(default).history.short_key})"),
        *(option(f"--qos-{name}", choices=policy.short_keys(),
                 help=f"Quality of service {name} setting to {way} with (overrides {name} value of "
                 "--qos-profile option, default: Compatible profile with running endpoints )")
          for name, policy in policies.items()),
        option("--qos-liveliness", choices=LivelinessPolicy.short_keys(),
               help=f"Quality of service liveliness setting to {way} with (overrides liveliness "
               "value of --qos-profile option"),
        option("--qos-liveliness-lease-duration-seconds", type=finite,
               help=f"Quality of service liveliness lease duration setting to {way} with "
               "(overrides liveliness lease duration value of --qos-profile option"),
    ]  # fmt: skip


def profile(options: argparse.Namespace) -> QoSProfile:
    """The preset that the options name, with what they override."""
    chosen = _preset(options.qos_profile)
    if options.qos_history:
        chosen.history = HistoryPolicy[options.qos_history.upper()]
    if options.qos_durability:
        chosen.durability = DurabilityPolicy[options.qos_durability.upper()]
    if options.qos_reliability:
        chosen.reliability = ReliabilityPolicy[options.qos_reliability.upper()]
    if options.qos_liveliness:
        chosen.liveliness = LivelinessPolicy[options.qos_liveliness.upper()]
    lease = options.qos_liveliness_lease_duration_seconds
    if lease and lease > 0:
        chosen.liveliness_lease_duration = Duration(seconds=lease)
    if options.qos_depth and options.qos_depth > 0:
        chosen.depth = options.qos_depth
    elif chosen.durability == DurabilityPolicy.TRANSIENT_LOCAL and chosen.depth == 0:
        chosen.depth = 1
    return chosen


def profile_for(options: argparse.Namespace, publishers: Sequence[Any]) -> QoSProfile:
    """The profile of a subscription, compatible with the publishers unless options override it."""
    if any(getattr(options, f"qos_{name}") is not None for name in _OVERRIDES):
        return profile(options)
    chosen = _preset(options.qos_profile)
    if publishers:
        offers = [publisher.qos_profile for publisher in publishers]
        reliable, best_effort = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
        latched, volatile = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
        chosen.reliability = _offered(
            (offer.reliability for offer in offers), reliable, best_effort
        )
        chosen.durability = _offered((offer.durability for offer in offers), latched, volatile)
    return chosen


def _offered(offers: Iterable[Any], strict: Any, lenient: Any) -> Any:
    """The strict policy if all offer it."""
    strict_offers = [offer == strict for offer in offers]
    if all(strict_offers):
        return strict
    if any(strict_offers):
        kind = f"QoS{type(strict).__name__}"
        print(
            f"Some, but not all, publishers are offering {kind}.{strict.name}. Falling back to "
            f"{kind}.{lenient.name} as it will connect to all publishers"
        )
    return lenient
