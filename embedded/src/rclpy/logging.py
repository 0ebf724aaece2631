"""Logging as ROS 2 does it."""

from __future__ import annotations

import os
from pathlib import Path

from rclpy.impl import log_levels
from rclpy.impl.log_output import Console, outputs
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.impl.rcutils_logger import RcutilsLogger

_root_logger = RcutilsLogger()


def get_logger(name: str) -> RcutilsLogger:
    """A logger of that name.

    Raises:
        ValueError: an empty name.
    """
    if not name:
        raise ValueError("Logger name must not be empty.")
    return _root_logger.get_child(name)


def initialize() -> None:
    """Reads the console's settings from the environment."""
    outputs.console = Console()


def shutdown() -> None:
    """Forgets the loggers' levels."""
    log_levels.clear()


def clear_config() -> None:
    """Resets the levels and reads the settings again."""
    shutdown()
    initialize()


def set_logger_level(name: str, level: LoggingSeverity | int, detailed_error: bool = False) -> None:
    """Level of one logger and those below it; the empty name is the default of all."""
    log_levels.set_level(name, level)


def get_logger_level(name: str) -> LoggingSeverity:
    """The level that a logger was given itself."""
    return log_levels.level_of(name)


def get_logger_effective_level(name: str) -> LoggingSeverity:
    """The level that counts for a logger: its own, or the nearest parent's."""
    return log_levels.effective_level(name)


def get_logging_severity_from_string(log_severity: str) -> LoggingSeverity:
    """The severity of that name.

    Raises:
        RuntimeError: There is no severity of this name.
    """
    try:
        return LoggingSeverity[log_severity.upper()]
    except KeyError:
        raise RuntimeError(
            f"Failed to get log severity from name: {log_severity}, "
            "expected: UNSET, DEBUG, INFO, WARN, ERROR or FATAL"
        ) from None


def get_logging_directory() -> Path:
    """Where ROS 2 would put log files: ROS_LOG_DIR, or `log` in ROS_HOME or in `~/.ros`."""
    directory = os.environ.get("ROS_LOG_DIR")
    if directory:
        return Path(directory).expanduser()
    return Path(os.environ.get("ROS_HOME") or "~/.ros").expanduser() / "log"
