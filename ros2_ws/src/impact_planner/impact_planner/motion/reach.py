"""Limits of the arm's reach from a given stance: largest angle and largest l_B, section II.C.1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import AngleUnreachable
from impact_planner.hit.door_prediction import opening_limit
from impact_planner.hit.placement import Placement
from impact_planner.hit.stance import HitStance
from impact_planner.motion.catch import HoldTask, can_hold, hold_task
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import PlannerSettings

_ANGLE_STEP, _ANGLE_TOLERANCE = np.radians(5.0), np.radians(0.25)  # of the search [rad]
_DISTANCE_STEP, _DISTANCE_TOLERANCE = 0.05, 0.0025  # of the search [m]


def largest_angle(
    robot: RobotModel,
    known: KnownDoor,
    settings: PlannerSettings,
    placement: Placement,
    stance: HitStance,
) -> float:
    """Find the largest angle at which the arm can catch and hold the door, to 0.25 deg.

    Only the arm's reach and the closer's torque are checked. Smaller angles may be out of reach,
    the hit may be too fast, and walls near the door are not modelled.

    Args:
        robot: The robot.
        known: The door.
        settings: Configuration, of which hand_force_limit is used.
        placement: Place of the door.
        stance: Feet and posture at the hit.

    Returns:
        The largest opening angle [rad].

    Raises:
        AngleUnreachable: The arm can hold the door at no angle.
    """
    task = _task(known, settings, placement, stance)
    limit = opening_limit(known.door)

    def held(angle: float) -> bool:
        return can_hold(robot, replace(task, angle=angle))

    found = _last(held, np.arange(_ANGLE_STEP, limit, _ANGLE_STEP).tolist(), _ANGLE_TOLERANCE)
    if found is None:
        raise AngleUnreachable(
            "the arm can hold the door at no angle from this stance",
            quantity="desired_opening_angle [rad]", value=limit, limit=0.0, phase="hold")
    return found


def furthest_contact(
    robot: RobotModel,
    known: KnownDoor,
    settings: PlannerSettings,
    placement: Placement,
    stance: HitStance,
    angle: float,
) -> float:
    """Find the largest l_B from which the arm can hold the door at an angle, to 2.5 mm.

    A robot that hits the leaf farther from the hinge stands farther from the hinge, and its arm
    reaches less of the opened leaf.

    Args:
        robot: The robot.
        known: The door.
        settings: Configuration, of which hand_force_limit is used.
        placement: Place of the door.
        stance: Feet and posture at the hit.
        angle: Desired opening angle [rad].

    Returns:
        The largest l_B [m].

    Raises:
        AngleUnreachable: The arm can hold the door at the angle from no l_B.
    """
    task = replace(_task(known, settings, placement, stance), angle=angle)
    elbow = float(stance.posture.elbow[0])

    def held(l_b: float) -> bool:
        hinge = np.array([elbow - l_b, -placement.door_distance])
        return can_hold(robot, replace(task, hinge=hinge))

    nearest = robot.config.contact_radius
    found = _last(
        held, np.arange(nearest, known.width + 1e-9, _DISTANCE_STEP).tolist(),
        _DISTANCE_TOLERANCE)
    if found is None:
        raise AngleUnreachable(
            f"the arm can hold the door at {np.degrees(angle):.1f} deg from no l_B on the leaf",
            quantity="l_b [m]", value=angle, limit=(nearest, known.width), phase="hold")
    return found


def _task(
    known: KnownDoor, settings: PlannerSettings, placement: Placement, stance: HitStance
) -> HoldTask:
    """The task of holding the door from the posture at the hit, with an angle of 0."""
    start = stance.posture.joints, stance.posture.base
    return hold_task(known, settings, placement.hinge, stance.feet, 0.0, start)


def _last(held: Callable[[float], bool], tries: list[float], tolerance: float) -> float | None:
    """The largest value for which `held` is true, or None.

    The last such value among the tries is refined by bisection towards the next try.
    """
    good = next((i for i in range(len(tries) - 1, -1, -1) if held(tries[i])), None)
    if good is None:
        return None
    low = tries[good]
    high = tries[good + 1] if good + 1 < len(tries) else low
    while high - low > tolerance:
        middle = 0.5 * (low + high)
        if held(middle):
            low = middle
        else:
            high = middle
    return low
