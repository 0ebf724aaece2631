"""Checks of footsteps against the robot's limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NoReturn

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, RobotConfig, StepLimits, needed

from walking.errors import InvalidFootsteps
from walking.footsteps.footstep import OUTWARD, Footstep, Pose, Stance, other, wrapped
from walking.footsteps.soles import sole_distances

_ROUNDING = 1e-9  # by how much a step may exceed a limit [m, rad]
_SHORTEST, _LONGEST = 0.3, 10.0  # shortest and longest duration of a step [s]
_MOST = 1000  # largest number of footsteps


def check_footsteps(
    robot: RobotConfig, stance: Stance, footsteps: Sequence[Footstep]
) -> None:
    """Check footsteps: numbers, sides, durations, distances between the feet, and overlap.

    Args:
        robot: The robot.
        stance: The soles before the first footstep.
        footsteps: The footsteps.

    Raises:
        InvalidFootsteps: A check fails; the error names the footstep, counted from 1, the value
            and the limit.
        RobotConfigError: The robot has no limits of footsteps.
    """
    limits = needed(robot.footsteps, "footsteps")
    if len(footsteps) > _MOST:
        _refuse("there are too many footsteps", "footsteps", len(footsteps), _MOST)
    for side in SIDES:
        _require_numbers(f"the {side} foot before the first step", stance.foot(side))
    for number, step in enumerate(footsteps, start=1):
        _require_plain(number, step)
    for number in range(1, len(footsteps)):
        if footsteps[number].side == footsteps[number - 1].side:
            _refuse(f"footstep {number + 1} is of the same foot as the one before",
                    "side", footsteps[number].side, other(footsteps[number].side))
    if not footsteps:
        return
    placed, standing = _feet(stance, footsteps)
    for name, excess, value, limit in step_excess(robot, limits, footsteps, placed, standing):
        worst = int(np.argmax(excess))
        if excess[worst] > _ROUNDING:
            _refuse(f"footstep {worst + 1}: {name}", name, float(value[worst]), float(limit[worst]))


def fits(robot: RobotConfig, stance: Stance, footsteps: Sequence[Footstep]) -> bool:
    """Whether footsteps that are numbers of alternating sides keep every limit of distances."""
    placed, standing = _feet(stance, footsteps)
    limits = needed(robot.footsteps, "footsteps")
    return all(float(excess.max()) <= _ROUNDING for _, excess, _, _ in step_excess(
        robot, limits, footsteps, placed, standing))


def step_excess(
    robot: RobotConfig, limits: StepLimits, footsteps: Sequence[Footstep],
    placed: Array, standing: Array,
) -> list[tuple[str, Array, Array, Array]]:
    """Compute by how much each of N footsteps exceeds each limit.

    Args:
        robot: The robot, for its soles.
        limits: Limits.
        footsteps: The footsteps, for their sides.
        placed: x, y [m] and yaw [rad] of the soles that are placed, (N, 3).
        standing: The same of the soles that stand meanwhile, (N, 3).

    Returns:
        For each limit its name with unit, excesses, values and limits, (N,) each.
    """
    out = np.array([OUTWARD[step.side] for step in footsteps])
    cos, sin = np.cos(standing[:, 2]), np.sin(standing[:, 2])
    dx, dy = (placed - standing)[:, :2].T
    ahead, aside = cos * dx + sin * dy, out * (cos * dy - sin * dx)
    turn = np.array([wrapped(float(angle)) for angle in placed[:, 2] - standing[:, 2]])
    rows = [
        ("distance ahead of the other foot [m]", ahead, limits.ahead, 1.0),
        ("distance behind the other foot [m]", -ahead, limits.back, 1.0),
        ("distance to the other foot's side [m]", aside, limits.widest, 1.0),
        ("smallest distance to the other foot's side [m]", aside, limits.narrowest, -1.0),
        ("turn to the other foot [rad]", np.abs(turn), limits.turn, 1.0),
        ("distance between the soles [m]",
         _sole_distances(robot, footsteps, placed, standing), limits.clearance, -1.0),
    ]
    return [(name, sign * (value - limit), value, np.full(len(value), limit))
            for name, value, limit, sign in rows]


def _sole_distances(
    robot: RobotConfig, footsteps: Sequence[Footstep], placed: Array, standing: Array
) -> Array:
    gap = np.empty(len(placed))
    for side in SIDES:
        rows = [index for index, step in enumerate(footsteps) if step.side == side]
        gap[rows] = sole_distances(robot, side, placed[rows], standing[rows])
    return gap


def _feet(stance: Stance, footsteps: Sequence[Footstep]) -> tuple[Array, Array]:
    """Poses of the placed and of the standing soles, (N, 3) each."""
    placed = np.array([step.pose for step in footsteps])
    first = np.array([stance.foot(other(footsteps[0].side))])
    return placed, np.vstack([first, placed[:-1]])


def _require_plain(number: int, step: Footstep) -> None:
    if step.side not in SIDES:
        _refuse(f"footstep {number} has an unknown side", "side", step.side, " or ".join(SIDES))
    _require_numbers(f"footstep {number}", step.pose)
    if not _SHORTEST <= step.duration <= _LONGEST:
        _refuse(f"footstep {number} has a duration out of range", "duration [s]", step.duration,
                (_SHORTEST, _LONGEST))


def _require_numbers(what: str, pose: Pose) -> None:
    for name, value in zip(("x [m]", "y [m]", "yaw [rad]"), pose, strict=True):
        if not math.isfinite(value):
            _refuse(f"{what} has a {name} that is not a number", name, value, "a finite number")


def _refuse(what: str, quantity: str, value: object, limit: object) -> NoReturn:
    shown = [f"{item:.4g}" if isinstance(item, float) else str(item) for item in (value, limit)]
    raise InvalidFootsteps(
        f"{what}: {shown[0]}, the limit is {shown[1]}",
        quantity=quantity, value=value, limit=limit)
