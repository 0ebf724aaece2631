"""Stamps of messages as numbers, and back."""

from __future__ import annotations

from typing import Any

from builtin_interfaces.msg import Duration, Time

NANOSECONDS = 1_000_000_000  # in a second


def nanoseconds(stamp: Any) -> int:
    """A message's time or duration [ns]."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def seconds(stamp: Any) -> float:
    """A message's time or duration [s]; a float keeps a time of today to about 0.2 us."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def stamp_of(nanoseconds: int) -> Time:
    """The message of a time [ns]."""
    return Time(sec=nanoseconds // NANOSECONDS, nanosec=nanoseconds % NANOSECONDS)


def duration_of(nanoseconds: int) -> Duration:
    """The message of a duration [ns]."""
    return Duration(sec=nanoseconds // NANOSECONDS, nanosec=nanoseconds % NANOSECONDS)
