"""Conversion of messages' stamps to numbers and back."""

from __future__ import annotations

from typing import Any

from builtin_interfaces.msg import Duration, Time

NANOSECONDS = 1_000_000_000  # nanoseconds in a second


def nanoseconds(stamp: Any) -> int:
    """Convert a Time or Duration message to nanoseconds."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def seconds(stamp: Any) -> float:
    """Convert a Time or Duration message to seconds; rounds today's time to about 0.2 us."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def stamp_of(nanoseconds: int) -> Time:
    """Convert nanoseconds since the clock's epoch to a Time message."""
    return Time(sec=nanoseconds // NANOSECONDS, nanosec=nanoseconds % NANOSECONDS)


def duration_of(nanoseconds: int) -> Duration:
    """The message of a duration [ns]."""
    return Duration(sec=nanoseconds // NANOSECONDS, nanosec=nanoseconds % NANOSECONDS)
