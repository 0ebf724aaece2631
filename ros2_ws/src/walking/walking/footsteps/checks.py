"""Checks of footsteps against the robot's limits, and the distance between two soles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NoReturn

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, RobotConfig, StepLimits, needed

from walking.errors import InvalidFootsteps
from walking.footsteps.footstep import OUTWARD, Footstep, Pose, Stance, other
from walking.footsteps.rectangles import gaps

_ROUNDING = 1e-9  # by how much a step may exceed a limit [m, rad]
_SHORTEST, _LONGEST = 0.3, 10.0  # shortest and longest duration of a step [s]
_MOST = 1000  # largest number of footsteps


def check_footsteps(
    robot: RobotConfig, stance: Stance, footsteps: Sequence[Footstep],
    limits: StepLimits | None = None,
) -> None:
    """Check footsteps: numbers, sides, durations, distances between the feet, and overlap.

    Args:
        stance: The soles before the first footstep.
        limits: Limits; None means those of the robot.

    Raises:
        InvalidFootsteps: A check fails; the error names the footstep, counted from 1, the value
            and the limit.
        RobotConfigError: The robot has no limits of footsteps.
    """
    limits = limits or needed(robot.footsteps, "footsteps")
    if len(footsteps) > _MOST:
        _refuse("there are too many footsteps", "footsteps", len(footsteps), _MOST)
    for side in SIDES:
        require_numbers(f"the {side} foot before the first step", stance.foot(side))
    for number, step in enumerate(footsteps, start=1):
        _require_plain(number, step)
    for number in range(1, len(footsteps)):
        if footsteps[number].side == footsteps[number - 1].side:
            _refuse(f"footstep {number + 1} is of the same foot as the one before",
                    "side", footsteps[number].side, other(footsteps[number].side))
    if not footsteps:
        return
    placed = np.array([step.pose for step in footsteps])
    sides = [step.side for step in footsteps]
    for name, value, limit, sign in _distances(robot, limits, stance, sides, placed):
        worst = int(np.argmax(sign * value))
        if sign * (value[worst] - limit) > _ROUNDING:
            _refuse(f"footstep {worst + 1}: {name}", name, float(value[worst]), limit)


def fits(
    robot: RobotConfig, stance: Stance, sides: Sequence[str], placed: Array,
    limits: StepLimits | None = None,
) -> bool:
    """Return whether soles of alternating sides keep every limit of distances.

    Args:
        stance: The soles before the first footstep.
        sides: Sides of the N footsteps.
        placed: x, y [m] and yaw [rad] of the soles after them, (N, 3).
        limits: Limits; None means those of the robot.
    """
    limits = limits or needed(robot.footsteps, "footsteps")
    return all(float((sign * (value - limit)).max()) <= _ROUNDING
               for _, value, limit, sign in _distances(robot, limits, stance, sides, placed))


def _distances(
    robot: RobotConfig, limits: StepLimits, stance: Stance, sides: Sequence[str], placed: Array
) -> Iterator[tuple[str, Array, float, float]]:
    """Yield what has a limit: name with unit, values (N,), limit, and -1.0 for a lower limit."""
    standing = np.vstack([stance.foot(other(sides[0])), placed[:-1]])
    out = np.array([OUTWARD[side] for side in sides])
    cos, sin = np.cos(standing[:, 2]), np.sin(standing[:, 2])
    dx, dy = (placed - standing)[:, :2].T
    ahead, aside = cos * dx + sin * dy, out * (cos * dy - sin * dx)
    turn = placed[:, 2] - standing[:, 2]
    turn = np.abs(turn - 2.0 * math.pi * np.round(turn / (2.0 * math.pi)))
    yield "distance ahead of the other foot [m]", ahead, limits.ahead, 1.0
    yield "distance behind the other foot [m]", -ahead, limits.back, 1.0
    yield "distance to the other foot's side [m]", aside, limits.widest, 1.0
    yield "smallest distance to the other foot's side [m]", aside, limits.narrowest, -1.0
    yield "turn to the other foot [rad]", turn, limits.turn, 1.0
    gap = np.empty(len(placed))
    for first, side in enumerate(sides[:2]):
        gap[first::2] = sole_distances(robot, side, placed[first::2], standing[first::2])
    yield "distance between the soles [m]", gap, limits.clearance, -1.0


def _require_plain(number: int, step: Footstep) -> None:
    if step.side not in SIDES:
        _refuse(f"footstep {number} has an unknown side", "side", step.side, " or ".join(SIDES))
    require_numbers(f"footstep {number}", step.pose)
    if not _SHORTEST <= step.duration <= _LONGEST:
        _refuse(f"footstep {number} has a duration out of range", "duration [s]", step.duration,
                (_SHORTEST, _LONGEST))


def require_numbers(what: str, pose: Pose) -> None:
    """Check that a pose consists of finite numbers.

    Args:
        what: What the pose is, for the message.

    Raises:
        InvalidFootsteps: A coordinate is not finite.
    """
    for name, value in zip(("x [m]", "y [m]", "yaw [rad]"), pose, strict=True):
        if not math.isfinite(value):
            _refuse(f"{what} has a {name} that is not a number", name, value, "a finite number")


def _refuse(what: str, quantity: str, value: object, limit: object) -> NoReturn:
    shown = [f"{item:.4g}" if isinstance(item, float) else str(item) for item in (value, limit)]
    raise InvalidFootsteps(
        f"{what}: {shown[0]}, the limit is {shown[1]}",
        quantity=quantity, value=value, limit=limit)


def sole_distances(robot: RobotConfig, side: str, placed: Array, standing: Array) -> Array:
    """Compute the signed distances between a sole and the other one, (N,) [m].

    They are those of `rectangles.gaps`: negative where the soles overlap.

    Args:
        side: Side of the first sole.
        placed: x, y [m] and yaw [rad] of the first sole, (N, 3).
        standing: The same of the other sole, (N, 3).
    """
    return gaps(robot.soles[side], placed, robot.soles[other(side)], standing)
