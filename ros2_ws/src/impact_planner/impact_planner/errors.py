"""Errors of planning and execution; `reason` is the error code of the service or action."""

from __future__ import annotations

from typing import Any

from door_impact_common.errors import DoorImpactError
from humanoid_motion.errors import HumanoidMotionError


class PlannerError(DoorImpactError):
    """A plan cannot be made; `reason` is the service's error code in small letters."""

    reason = "invalid_request"


class InvalidRequest(PlannerError):
    """A request, a setting or a file holds a value outside its range or an unknown word."""

    reason = "invalid_request"


class NoDoor(PlannerError):
    """No parameters of the door are available: it is neither identified nor configured."""

    reason = "no_door"


class AngleUnreachable(PlannerError):
    """The door does not open to the angle, or the arm cannot hold the leaf there.

    `phase` is ``hold`` where the arm is the limit, and empty where the door is.
    """

    reason = "angle_unreachable"


class SpeedUnreachable(PlannerError):
    """No run-up reaches the speed of B, or the door would not leave the robot after the hit."""

    reason = "speed_unreachable"


class GearOverload(PlannerError):
    """The hit would make the teeth of a gear skip."""

    reason = "joint_limit"


PLANNING_ERRORS = (PlannerError, HumanoidMotionError)
"""What `plan_impact` raises: the request cannot be met, or the robot's body cannot do it."""


class GoalRefused(DoorImpactError):
    """A goal cannot be executed; `reason` is the action's error code in small letters."""

    def __init__(self, reason: str, message: str, **attributes: Any) -> None:
        super().__init__(message, reason=reason, **attributes)


class ImplausibleHit(DoorImpactError):
    """Nothing is learned from a hit, because its report does not fit what can have happened."""

    reason = "implausible_hit"
