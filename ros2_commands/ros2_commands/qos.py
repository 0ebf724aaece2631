"""Choose the quality of service of a command's publisher or subscription."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from copy import copy
from typing import Any

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
)

from ros2_commands.options import count

_POLICIES: dict[str, Any] = {
    "history": HistoryPolicy,
    "reliability": ReliabilityPolicy,
    "durability": DurabilityPolicy,
}


def add_qos(parser: argparse.ArgumentParser, default: str) -> None:
    """Add the options of a quality of service; `default` is the name of a preset."""
    parser.add_argument("--qos-profile", choices=QoSPresetProfiles.short_keys(), default=default,
                        help=f"preset profile (default: {default})")  # fmt: skip
    parser.add_argument("--qos-depth", type=count, metavar="N", help="length of the queue")
    for name, policy in _POLICIES.items():
        parser.add_argument(f"--qos-{name}", choices=policy.short_keys())


def profile(options: argparse.Namespace) -> QoSProfile:
    """Return the preset that the options name, with what they override."""
    chosen = copy(QoSPresetProfiles.get_from_short_key(options.qos_profile))
    if options.qos_depth:
        chosen.depth = options.qos_depth
    for name, policy in _POLICIES.items():
        if key := getattr(options, f"qos_{name}"):
            setattr(chosen, name, policy.get_from_short_key(key))
    return chosen


def matching_profile(options: argparse.Namespace, publishers: Sequence[Any]) -> QoSProfile:
    """Return a subscription's profile: as strict as all publishers, unless options override it."""
    chosen = profile(options)
    given = [options.qos_depth, *(getattr(options, f"qos_{name}") for name in _POLICIES)]
    if publishers and not any(given):
        offers = [publisher.qos_profile for publisher in publishers]
        chosen.reliability = _common(
            [offer.reliability for offer in offers],
            ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT,
        )  # fmt: skip
        chosen.durability = _common(
            [offer.durability for offer in offers],
            DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE,
        )  # fmt: skip
    return chosen


def _common(offers: list[Any], strict: Any, lenient: Any) -> Any:
    """Choose the strict policy if all publishers offer it."""
    if all(offer == strict for offer in offers):
        return strict
    if strict in offers:
        kind = f"QoS{type(strict).__name__}"
        print(f"Some, but not all, publishers are offering {kind}.{strict.name}. Falling back to "
              f"{kind}.{lenient.name} as it will connect to all publishers")  # fmt: skip
    return lenient
