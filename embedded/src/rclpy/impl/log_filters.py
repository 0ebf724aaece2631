"""Filters of log calls: only the first call, not the first call, one call per period."""

from __future__ import annotations

import time
from typing import Any

from rclpy.clock_type import ClockType
from rclpy.impl.logging_severity import LoggingSeverity

_REQUIRED = object()
_FILTERS: dict[str, dict[str, Any]] = {
    "throttle": {"throttle_duration_sec": _REQUIRED, "throttle_time_source_type": None},
    "skip_first": {"skip_first": _REQUIRED},
    "once": {"once": _REQUIRED},
}
"""The options of the filters with their defaults, in the order of application."""
_OPTIONS = [option for options in _FILTERS.values() for option in options]


def _detected(given: dict[str, Any]) -> dict[str, Any]:
    """The options of the filters that a call uses.

    Raises:
        TypeError: an unknown option, or one that another needs is missing.
    """
    wanted: dict[str, Any] = {}
    for name, options in _FILTERS.items():
        if not any(given.get(option) for option in options):
            continue
        for option, default in options.items():
            if option not in given and default is _REQUIRED:
                raise TypeError(
                    f'required parameter "{option}" not specified '
                    f'but is required for the the logging filter "{name}"'
                )
            wanted[option] = given.get(option, default)
    for option in given:
        if option not in _OPTIONS:
            raise TypeError(
                f'parameter "{option}" is not one of the recognized logging options "{_OPTIONS}"'
            )
    return wanted


class CallSite:
    """A line of a program that logs: all its calls must have the options of the first one."""

    def __init__(self, name: str, severity: LoggingSeverity, given: dict[str, Any]) -> None:
        """Stores the options of the first call.

        Raises:
            TypeError: an unknown option, or one that another needs is missing.
            ValueError: The clock is not a clock.
        """
        self._name, self._severity, self._options = name, severity, _detected(given)
        clock = self._options.get("throttle_time_source_type")
        if clock is not None and not isinstance(getattr(clock, "clock_type", None), ClockType):
            raise ValueError(
                f'Received throttle_time_source_type of "{clock}" is not a clock instance'
            )
        self._last = 0
        self._logged = self._skipped = False

    def check(self, name: str, severity: LoggingSeverity, given: dict[str, Any]) -> None:
        """Raises ValueError if a call has other options than the first one."""
        if severity != self._severity:
            raise ValueError("Logger severity cannot be changed between calls.")
        if name != self._name:
            raise ValueError("Logger name cannot be changed between calls.")
        options = _detected(given) if given or self._options else self._options
        if options.keys() != self._options.keys():
            raise ValueError("Requested logging filters cannot be changed between calls.")
        if options != self._options:
            raise ValueError("Logging filter parameters cannot be changed between calls.")

    def passes(self) -> bool:
        """Whether this call writes."""
        options = self._options
        if "throttle_duration_sec" in options:
            clock = options["throttle_time_source_type"]
            now = time.time_ns() if clock is None else clock.now().nanoseconds
            if now < self._last + options["throttle_duration_sec"] * 1e9:
                return False
            self._last = now
        if "skip_first" in options and not self._skipped:
            self._skipped = True
            return False
        if "once" in options:
            if self._logged:
                return False
            self._logged = True
        return True
