"""Loggers that write to stderr as ROS 2 does."""

from __future__ import annotations

import sys
import threading
import time
from enum import IntEnum
from typing import Any

from rclpy.clock import Clock


class LoggingSeverity(IntEnum):
    """How bad it is."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


_COLOURS = {
    LoggingSeverity.DEBUG: "\033[32m",
    LoggingSeverity.WARN: "\033[33m",
    LoggingSeverity.ERROR: "\033[31m",
    LoggingSeverity.FATAL: "\033[31m",
}
_levels: dict[str, LoggingSeverity] = {"": LoggingSeverity.INFO}
_lock = threading.Lock()


def get_logging_severity_from_string(text: str) -> LoggingSeverity:
    """The severity of that name.

    Raises:
        ValueError: there is none.
    """
    try:
        return LoggingSeverity[text.upper()]
    except KeyError:
        raise ValueError(f"'{text}' is no log level: debug, info, warn, error or fatal") from None


def set_logger_level(name: str, level: LoggingSeverity | int) -> None:
    """Level of one logger and those below it; the empty name is the default of all."""
    _levels[name] = LoggingSeverity(level)


def get_logger_effective_level(name: str) -> LoggingSeverity:
    """The level that counts for a logger: its own, or the nearest parent's."""
    while name:
        level = _levels.get(name, LoggingSeverity.UNSET)
        if level != LoggingSeverity.UNSET:
            return level
        name = name.rpartition(".")[0]
    return _levels[""]


class RcutilsLogger:
    """A logger with a name; names are split at dots."""

    def __init__(self, name: str, clock: Clock | None = None) -> None:
        """Throttling goes by `clock`."""
        self.name, self._clock = name, clock or Clock()
        self._calls: dict[Any, int] = {}

    def get_child(self, name: str) -> RcutilsLogger:
        """A logger below this one."""
        return RcutilsLogger(f"{self.name}.{name}" if self.name else name, self._clock)

    def set_level(self, level: LoggingSeverity | int) -> None:
        """Messages below this level are left out."""
        set_logger_level(self.name, level)

    def get_effective_level(self) -> LoggingSeverity:
        """The level that counts."""
        return get_logger_effective_level(self.name)

    def is_enabled_for(self, severity: LoggingSeverity | int) -> bool:
        """Whether a message of this severity is written."""
        return severity >= self.get_effective_level()

    def log(
        self,
        message: str,
        severity: LoggingSeverity | int,
        *,
        throttle_duration_sec: float | None = None,
        skip_first: bool = False,
        once: bool = False,
        throttle_time_source_type: Any = None,
    ) -> bool:
        """Writes a message; whether it was written.

        Args:
            message: the text.
            severity: how bad it is.
            throttle_duration_sec: this line of the program writes at most once in this time [s].
            skip_first: not the first time.
            once: only the first time.
            throttle_time_source_type: a clock to throttle by.
        """
        severity = LoggingSeverity(severity)
        if not self.is_enabled_for(severity):
            return False
        if throttle_duration_sec is not None or skip_first or once:
            clock = throttle_time_source_type or self._clock
            if not self._pass_filters(clock, throttle_duration_sec, skip_first, once):
                return False
        _write(severity, self.name, str(message))
        return True

    def _pass_filters(
        self, clock: Clock, throttle: float | None, skip_first: bool, once: bool
    ) -> bool:
        frame = sys._getframe(3)
        line = (frame.f_code, frame.f_lineno)
        last, now = self._calls.get(line), clock.nanoseconds()
        if last is None:
            self._calls[line] = now
            return not skip_first
        if once:
            return False
        if throttle is not None:
            if 0 <= now - last < throttle * 1e9:
                return False
            self._calls[line] = now
        return True

    def debug(self, message: str, **options: Any) -> bool:
        """Writes a DEBUG message; options as in `log`."""
        return self.log(message, LoggingSeverity.DEBUG, **options)

    def info(self, message: str, **options: Any) -> bool:
        """Writes an INFO message; options as in `log`."""
        return self.log(message, LoggingSeverity.INFO, **options)

    def warning(self, message: str, **options: Any) -> bool:
        """Writes a WARN message; options as in `log`."""
        return self.log(message, LoggingSeverity.WARN, **options)

    def warn(self, message: str, **options: Any) -> bool:
        """Writes a WARN message; options as in `log`."""
        return self.log(message, LoggingSeverity.WARN, **options)

    def error(self, message: str, **options: Any) -> bool:
        """Writes an ERROR message; options as in `log`."""
        return self.log(message, LoggingSeverity.ERROR, **options)

    def fatal(self, message: str, **options: Any) -> bool:
        """Writes a FATAL message; options as in `log`."""
        return self.log(message, LoggingSeverity.FATAL, **options)


def _write(severity: LoggingSeverity, name: str, message: str) -> None:
    sec, nanosec = divmod(time.time_ns(), 1_000_000_000)
    line = f"[{severity.name}] [{sec}.{nanosec:09d}] [{name}]: {message}"
    colour = _COLOURS.get(severity, "") if sys.stderr.isatty() else ""
    with _lock:
        sys.stderr.write(f"{colour}{line}\033[0m\n" if colour else f"{line}\n")
        sys.stderr.flush()


def get_logger(name: str) -> RcutilsLogger:
    """A logger of that name."""
    if not name:
        raise ValueError("Logger name must not be empty.")
    return RcutilsLogger(name)
