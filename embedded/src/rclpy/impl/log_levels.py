"""The levels of all loggers of the process."""

from __future__ import annotations

from rclpy.impl.logging_severity import LoggingSeverity

_DEFAULT = {"": LoggingSeverity.INFO}
_levels: dict[str, LoggingSeverity] = dict(_DEFAULT)


def clear() -> None:
    """Every logger has the default level again."""
    _levels.clear()
    _levels.update(_DEFAULT)


def set_level(name: str, level: LoggingSeverity | int) -> None:
    """Level of one logger and those below it; the empty name is the default of all."""
    _levels[name] = LoggingSeverity(level)


def level_of(name: str) -> LoggingSeverity:
    """The level that a logger was given itself."""
    return _levels.get(name, LoggingSeverity.UNSET)


def effective_level(name: str) -> LoggingSeverity:
    """The level that counts for a logger: its own, or the nearest parent's."""
    if len(_levels) > 1:
        while name:
            level = _levels.get(name, LoggingSeverity.UNSET)
            if level != LoggingSeverity.UNSET:
                return level
            name = name.rpartition(".")[0]
    return _levels[""]
