"""Small helpers."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from rclpy.arguments import parse_arguments
from rclpy.context import Context, get_default_context


def ok(*, context: Context | None = None) -> bool:
    """Whether the context is initialised and not shut down."""
    return (context or get_default_context()).ok()


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """The command line without what is ROS's."""
    return parse_arguments(sys.argv if args is None else args).remaining


__all__ = ["get_default_context", "ok", "remove_ros_args"]


def get_rmw_implementation_identifier() -> str:
    """The middleware whose DDS mapping is spoken."""
    return "rmw_cyclonedds_cpp"
