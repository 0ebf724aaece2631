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


class PassageInfeasible(WalkingError):
    """The robot cannot pass the door: the opening, its reach, or the leaf's force forbid it."""

    reason = "passage_infeasible"


class InvalidGoal(WalkingError):
    """A number of a goal or a request is not finite or out of its range."""

    reason = "invalid_goal"


class NoDoor(WalkingError):
    """Nothing is known of the door, or of its frame."""

    reason = "no_door"


class HitNotPlanned(WalkingError):
    """The hit that opens the door cannot be planned, or does not end with a held leaf."""

    reason = "hit_not_planned"


class NotReady(WalkingError):
    """A motion cannot begin from where the robot is."""

    reason = "not_ready"


class Stopped(WalkingError):
    """The goal was cancelled between two motions."""

    reason = "stopped"


class BadDoorPose(WalkingError):
    """What is told of the door's place makes no sense, or the robot cannot walk there."""

    reason = "bad_door_pose"


class NotReached(WalkingError):
    """The robot does not stand where a hit begins."""

    reason = "not_reached"


PLANNING_ERRORS = (WalkingError, HumanoidMotionError)
"""What `plan_walk` raises: the footsteps are bad, or the robot's body cannot make the motion."""
