"""Names of an action's topics and services, and the states of goals."""

from __future__ import annotations

from enum import IntEnum
from typing import Any


class GoalStatus(IntEnum):
    """States of a goal, as in action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


def part(action_name: str, name: str) -> str:
    """Name of a topic or service of an action."""
    return f"{action_name}/_action/{name}"


def check_action_type(action_type: Any) -> None:
    """Raises TypeError unless it is the class of an action."""
    if not hasattr(action_type, "Goal") or not hasattr(action_type, "Impl"):
        raise TypeError(f"{action_type!r} is no action type")
