"""Section II.C.1 the other way round: how far a door can be opened and held from a stance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import AngleUnreachable
from impact_planner.hit.door_prediction import opening_limit
from impact_planner.hit.placement import Placement
from impact_planner.hit.stance import HitStance
from impact_planner.motion.hold import HoldTask, can_hold, hold_task
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import PlannerSettings

_ANGLE_STEP, _ANGLE_TOLERANCE = np.radians(5.0), np.radians(0.25)
_WAY_STEP, _WAY_TOLERANCE = 0.05, 0.0025  # [m]


def largest_angle(
    robot: RobotModel,
    known: KnownDoor,
    settings: PlannerSettings,
    placement: Placement,
    stance: HitStance,
) -> float:
    """The largest angle at which the arm can catch and hold the door from a stance, to 0.25 deg.

    By the arm's reach and the closer's torque alone: smaller angles may be out of reach, the hit
    may be too fast, and a frame beside the door is not known.

    Args:
        robot: The robot.
        known: The door.
        settings: Configuration; its hand_force_limit is the force that the robot may hold.
        placement: Where the door is.
        stance: Feet and posture at the hit.

    Returns:
        The angle [rad].

    Raises:
        AngleUnreachable: The door can be held at none.
    """
    task = _task(known, settings, placement, stance)
    limit = opening_limit(known.door)

    def held(angle: float) -> bool:
        return can_hold(robot, replace(task, angle=angle))

    found = _last(held, np.arange(_ANGLE_STEP, limit, _ANGLE_STEP).tolist(), _ANGLE_TOLERANCE)
    if found is None:
        raise AngleUnreachable(
            "the arm can hold the door at no angle from here",
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
    """The largest l_B from which the arm can hold the door at an angle, to 2.5 mm.

    The further from the hinge the robot hits, the further along the leaf it stands, and the less
    of the opened leaf its arm reaches.

    Args:
        robot: The robot.
        known: The door.
        settings: Configuration.
        placement: Where the door is.
        stance: Feet and posture at the hit.
        angle: Desired opening angle [rad].

    Returns:
        l_B [m].

    Raises:
        AngleUnreachable: The door can be held there from no l_B.
    """
    task = replace(_task(known, settings, placement, stance), angle=angle)
    elbow = float(stance.posture.elbow[0])

    def held(l_b: float) -> bool:
        hinge = np.array([elbow - l_b, -placement.door_distance])
        return can_hold(robot, replace(task, hinge=hinge))

    nearest = robot.config.contact_radius
    found = _last(
        held, np.arange(nearest, known.width + 1e-9, _WAY_STEP).tolist(), _WAY_TOLERANCE)
    if found is None:
        raise AngleUnreachable(
            f"the arm can hold the door at {np.degrees(angle):.1f} deg from no l_B",
            quantity="l_b [m]", value=angle, limit=(nearest, known.width), phase="hold")
    return found


def _task(
    known: KnownDoor, settings: PlannerSettings, placement: Placement, stance: HitStance
) -> HoldTask:
    """Holding from the posture at the hit; the angle is still open."""
    start = stance.posture.joints, stance.posture.base
    return hold_task(known, settings, placement.hinge, stance.feet, 0.0, start)


def _last(held: Callable[[float], bool], tries: list[float], tolerance: float) -> float | None:
    """The largest value that holds: the last of the tries that does, and on towards the next."""
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
