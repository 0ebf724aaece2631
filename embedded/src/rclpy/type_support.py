"""Whether a class is one of a message or of a service."""

from __future__ import annotations

from typing import Any


def check_is_valid_msg_type(msg_type: Any) -> None:
    """Raises AttributeError for what is no interface, RuntimeError for a service or an action."""
    if _is_interface(msg_type) and not hasattr(msg_type, "_spec"):
        raise RuntimeError(
            f"The message type provided is not valid ({msg_type}),"
            " this might be a service or action"
        )


def check_is_valid_srv_type(srv_type: Any) -> None:
    """Raises AttributeError for what is no interface, RuntimeError for a message or an action."""
    if _is_interface(srv_type) and not hasattr(srv_type, "Request"):
        raise RuntimeError(
            f"The service type provided is not valid ({srv_type}),"
            " this might be a message or action"
        )


def _is_interface(kind: Any) -> bool:
    if not (hasattr(kind, "_spec") or hasattr(kind, "_name")):
        raise AttributeError(
            f"type object '{getattr(kind, '__name__', kind)}' has no attribute '_TYPE_SUPPORT'"
            " This might be a ROS 1 message type but it should be a ROS 2 message type."
            " Make sure to source your ROS 2 workspace after your ROS 1 workspace."
        )
    return True
