"""Where log messages go: to the console in rcutils' form, and to `/rosout`."""

from __future__ import annotations

import os
import re
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from rclpy.impl.logging_severity import LoggingSeverity

_COLOURS = {
    LoggingSeverity.DEBUG: "\033[32m",
    LoggingSeverity.INFO: "\033[0m",
    LoggingSeverity.WARN: "\033[33m",
    LoggingSeverity.ERROR: "\033[31m",
    LoggingSeverity.FATAL: "\033[31m",
}
_DEFAULT_FORMAT = "[{severity}] [{time}] [{name}]: {message}"
_lock = threading.Lock()


@dataclass(frozen=True)
class Record:
    """A log message; `stamp` is the system's time [ns]."""

    severity: LoggingSeverity
    name: str
    message: str
    stamp: int
    function: str
    file: str
    line: int


def _date(stamp: int) -> str:
    seconds, rest = divmod(stamp, 1_000_000_000)
    text = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(seconds))
    return f"{text}.{rest // 1_000_000:03d}"


_TOKENS: dict[str, Callable[[Record], str]] = {
    "severity": lambda record: record.severity.name,
    "name": lambda record: record.name,
    "message": lambda record: record.message,
    "function_name": lambda record: record.function,
    "file_name": lambda record: record.file,
    "line_number": lambda record: str(record.line),
    "time": lambda record: "{}.{:09d}".format(*divmod(record.stamp, 1_000_000_000)),
    "time_as_nanoseconds": lambda record: f"{record.stamp:019d}",
    "date_time_with_ms": lambda record: _date(record.stamp),
}
_TOKEN = re.compile("{(" + "|".join(_TOKENS) + ")}")


def formatted(record: Record, form: str) -> str:
    """The line of a message; what is no token stays as it is."""
    return _TOKEN.sub(lambda match: _TOKENS[match[1]](record), form)


class Console:
    """The console's settings, from the environment."""

    def __init__(self) -> None:
        """Reads the variables of rcutils."""
        self.enabled = True
        self._form = os.environ.get("RCUTILS_CONSOLE_OUTPUT_FORMAT") or _DEFAULT_FORMAT
        self._stdout = os.environ.get("RCUTILS_LOGGING_USE_STDOUT") == "1"
        self._colour = os.environ.get("RCUTILS_COLORIZED_OUTPUT", "")

    def write(self, record: Record) -> None:
        """Writes a message."""
        if not self.enabled:
            return
        # Looked up at each call: tests and programs exchange the streams.
        stream = sys.stdout if self._stdout else sys.stderr
        line = formatted(record, self._form)
        if self._colour == "1" or (not self._colour and stream.isatty()):
            line = f"{_COLOURS[record.severity]}{line}\033[0m"
        with _lock, suppress(OSError):  # as rcutils, which ignores a full disk
            stream.write(line + "\n")
            stream.flush()


class Outputs:
    """Everything that a message goes to."""

    def __init__(self) -> None:
        """Has only the console at first."""
        self.console = Console()
        self.rosout: dict[str, Callable[[Record], Any]] = {}
        """The function that publishes on `/rosout`, by the logger's name."""

    def write(self, record: Record) -> None:
        """Writes a message everywhere."""
        self.console.write(record)
        publish = self.rosout.get(record.name)
        if publish is not None:
            publish(record)


outputs = Outputs()
