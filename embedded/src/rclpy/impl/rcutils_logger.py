"""Loggers."""

from __future__ import annotations

import os
import sys
import time
from types import FrameType
from typing import Any

from rclpy.impl import log_levels
from rclpy.impl.log_filters import CallSite
from rclpy.impl.log_output import Record, outputs
from rclpy.impl.logging_severity import LoggingSeverity


def _caller() -> FrameType:
    """The nearest frame outside this file."""
    frame = sys._getframe(1)
    while frame.f_code.co_filename == __file__ and frame.f_back is not None:
        frame = frame.f_back
    return frame


class RcutilsLogger:
    """A logger with a name; names are split at dots."""

    def __init__(self, name: str = "") -> None:
        """Has no call sites yet."""
        self.name = name
        self._sites: dict[Any, CallSite] = {}

    def get_child(self, name: str) -> RcutilsLogger:
        """A logger below this one; it is published on `/rosout` if this one is.

        Raises:
            ValueError: an empty name.
        """
        if not name:
            raise ValueError("Child logger name must not be empty.")
        full = f"{self.name}.{name}" if self.name else name
        publish = outputs.rosout.get(self.name)
        if publish is not None:
            outputs.rosout.setdefault(full, publish)
        return RcutilsLogger(full)

    def set_level(self, level: LoggingSeverity | int) -> None:
        """Messages below this level are left out."""
        log_levels.set_level(self.name, level)

    def get_effective_level(self) -> LoggingSeverity:
        """The effective level of the logger."""
        return log_levels.effective_level(self.name)

    def is_enabled_for(self, severity: LoggingSeverity | int) -> bool:
        """Whether a message of this severity is written."""
        return LoggingSeverity(severity) >= log_levels.effective_level(self.name)

    def log(self, message: str, severity: LoggingSeverity | int, **kwargs: Any) -> bool:
        """Writes a message; False if it was left out.

        Args:
            message: the text.
            severity: how bad it is.
            kwargs: `throttle_duration_sec` (this line of the program writes at most once in that
                time), `throttle_time_source_type` (a clock for it), `skip_first`, `once`, `name`
                (of another logger).

        Raises:
            TypeError: an unknown option, or a message that is no text.
            ValueError: the same line asked for something else before.
        """
        severity = LoggingSeverity(severity)
        if severity < log_levels.effective_level(self.name):
            return False
        name = kwargs.pop("name", self.name)
        frame = _caller()
        key = (frame.f_code, frame.f_lasti)
        site = self._sites.get(key)
        if site is None:
            site = self._sites[key] = CallSite(name, severity, kwargs)
        else:
            site.check(name, severity, kwargs)
        if not site.passes():
            return False
        if not isinstance(message, str):
            raise TypeError(f"A log message must be a str, not {type(message).__name__}")
        if severity >= log_levels.effective_level(name):
            code = frame.f_code
            file = os.path.abspath(code.co_filename)
            outputs.write(
                Record(severity, name, message, time.time_ns(), code.co_name, file, frame.f_lineno)
            )
        return True

    def debug(self, message: str, **kwargs: Any) -> bool:
        """Writes a DEBUG message; options as in `log`."""
        return self.log(message, LoggingSeverity.DEBUG, **kwargs)

    def info(self, message: str, **kwargs: Any) -> bool:
        """Writes an INFO message; options as in `log`."""
        return self.log(message, LoggingSeverity.INFO, **kwargs)

    def warning(self, message: str, **kwargs: Any) -> bool:
        """Writes a WARN message; options as in `log`."""
        return self.log(message, LoggingSeverity.WARN, **kwargs)

    def warn(self, message: str, **kwargs: Any) -> bool:
        """Writes a WARN message; options as in `log`."""
        return self.log(message, LoggingSeverity.WARN, **kwargs)

    def error(self, message: str, **kwargs: Any) -> bool:
        """Writes an ERROR message; options as in `log`."""
        return self.log(message, LoggingSeverity.ERROR, **kwargs)

    def fatal(self, message: str, **kwargs: Any) -> bool:
        """Writes a FATAL message; options as in `log`."""
        return self.log(message, LoggingSeverity.FATAL, **kwargs)
