"""Errors: one class for each error code of the service PlanDoorImpact, and of the executor."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError
from humanoid_motion.errors import HumanoidMotionError


class ImpactError(DoorImpactError):
    """Base of this package's errors."""


class PlannerError(ImpactError):
    """A plan cannot be made; `reason` is the error code of the service, in small letters."""

    reason = "invalid_request"


class InvalidRequest(PlannerError):
    """A request that holds no number, a number outside its range or an unknown word."""

    reason = "invalid_request"


class ExperienceUnreadable(PlannerError):
    """The file of what hits have taught is none."""

    reason = "invalid_request"


class NoDoor(PlannerError):
    """Nothing is known of the door: neither identified nor configured."""

    reason = "no_door"


class AngleUnreachable(PlannerError):
    """The linkage does not assemble at the angle, or the arm does not reach the leaf there."""

    reason = "angle_unreachable"


class SpeedUnreachable(PlannerError):
    """The run-up to the speed of B would take the ZMP out of the support polygon."""

    reason = "speed_unreachable"


PLANNING_ERRORS = (PlannerError, HumanoidMotionError)
"""What planning raises: the request cannot be met, or the robot's body cannot do it."""


class GoalRefused(ImpactError):
    """A goal cannot be executed; `reason` is the error code of the action, in small letters."""

    def __init__(
        self,
        reason: str,
        message: str,
        *,
        quantity: str = "",
        value: object = None,
        limit: object = None,
    ) -> None:
        super().__init__(message, quantity=quantity, value=value, limit=limit, reason=reason)
