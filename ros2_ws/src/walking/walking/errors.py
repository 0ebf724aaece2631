"""Errors of this package; `reason` is an error code in small letters."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError
from humanoid_motion.errors import HumanoidMotionError


class WalkingError(DoorImpactError):
    """Base of this package's errors."""


class InvalidFootsteps(WalkingError):
    """Footsteps or a goal contain values that are not numbers, or steps beyond a limit."""

    reason = "invalid_footsteps"


class WalkInfeasible(WalkingError):
    """A walk would leave the soles with its ZMP, slip, or come too near to the floor or itself."""

    reason = "walk_infeasible"


class NotReady(WalkingError):
    """A walk cannot begin from where the robot is."""

    reason = "not_ready"


PLANNING_ERRORS = (WalkingError, HumanoidMotionError)
"""What `plan_walk` raises: the footsteps are bad, or the robot's body cannot make the motion."""
