"""Small helpers."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from rclpy.arguments import parse_arguments
from rclpy.context import Context, get_default_context
from rclpy.duration import S_TO_NS


def ok(*, context: Context | None = None) -> bool:
    """Whether the context is initialised and not shut down."""
    return (context or get_default_context()).ok()


def shutdown(*, context: Context | None = None) -> None:
    """Leaves the domain.

    Raises:
        RuntimeError: there was no `init`.
        RCLError: it has been left before, as after Ctrl-C.
    """
    (context or get_default_context(shutting_down=True)).shutdown()


def try_shutdown(*, context: Context | None = None) -> None:
    """Leaves the domain, if it is in one."""
    (context or get_default_context(shutting_down=True)).try_shutdown()


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """The command line without what is ROS's.

    Raises:
        ArgumentError: a ROS argument that cannot be understood.
        UnknownROSArgsError: ROS arguments that ROS does not know.
    """
    return parse_arguments(sys.argv if args is None else args).remaining


def get_rmw_implementation_identifier() -> str:
    """The middleware whose DDS mapping is spoken."""
    return "rmw_cyclonedds_cpp"


def get_available_rmw_implementations() -> set[str]:
    """The only one."""
    return {get_rmw_implementation_identifier()}


def timeout_sec_to_nsec(timeout_sec: float | None) -> int:
    """Converts a timeout to ns; None and negative ones become -1, which means no timeout."""
    if timeout_sec is None or timeout_sec < 0:
        return -1
    return int(float(timeout_sec) * S_TO_NS)
