"""The services through which others read and set the levels of a process's loggers."""

from __future__ import annotations

from typing import Any

from ros2_embedded.message_modules import service_class
from ros2_embedded.messages import message_class

from rclpy.logging import get_logger_level, set_logger_level


def start_logging_service(node: Any) -> None:
    """Starts `get_logger_levels` and `set_logger_levels` below the node's name."""
    for name, answer in (("Get", _get), ("Set", _set)):
        kind = service_class(f"rcl_interfaces/srv/{name}LoggerLevels")
        node.create_service(kind, f"{node.get_name()}/{name.lower()}_logger_levels", answer)


def _get(request: Any, response: Any) -> Any:
    level = message_class("rcl_interfaces/msg/LoggerLevel")
    response.levels = [level(name=n, level=int(get_logger_level(n))) for n in request.names]
    return response


def _set(request: Any, response: Any) -> Any:
    response.results = [_set_one(level) for level in request.levels]
    return response


def _set_one(level: Any) -> Any:
    result = message_class("rcl_interfaces/msg/SetLoggerLevelsResult")
    try:
        set_logger_level(level.name, level.level)
    except ValueError:
        return result(successful=False, reason="Failed reason: Invalid logger level.")
    return result(successful=True)
