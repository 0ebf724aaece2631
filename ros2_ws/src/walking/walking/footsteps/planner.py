"""Footsteps to a goal pose: the fewest of several ways to go there.

A way consists of straight pieces. On a piece the middle between the soles moves along a line while
its heading turns evenly, and each foot is placed beside the middle. Sideways motion and turns
advance only when the foot of that side steps (`leading`), so that the soles never come nearer to
each other than in the stance; ahead and back every step advances.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Protocol

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, RobotConfig, StepLimits, needed

from walking.errors import InvalidFootsteps, WalkInfeasible
from walking.footsteps.checks import check_footsteps, fits, require_numbers
from walking.footsteps.footstep import (
    OUTWARD,
    Footstep,
    Pose,
    Stance,
    other,
    stances,
    wrapped,
)

_REACHED = 1e-9  # distance below which a foot is where it should be [m, rad]
_FARTHEST = 50.0  # largest distance of a goal [m]
_MOST = 400  # largest number of steps on one piece of a way
_LONGER = 12  # further numbers of steps that are tried on a piece where the fewest do not do


class Room(Protocol):
    """What stands in the way of a robot, and ways around it."""

    def require_way(self, way: Sequence[Pose]) -> None:
        """Check a way of the middle between the soles, from place to place in odom.

        Raises:
            WalkInfeasible: Something is in the way.
        """

    def detours(self, begin: Pose, goal: Pose) -> Iterator[list[Pose]]:
        """Yield places in odom through which other ways lead from a place to another one."""


def plan_footsteps(
    robot: RobotConfig, stance: Stance, goal: Pose, duration: float = 0.8, *,
    first: str | None = None, keep_heading: bool = False, whole_turns: bool = False,
    room: Room | None = None,
) -> list[Footstep]:
    """Plan footsteps that end with the feet beside each other, their middle at a goal.

    The fewest footsteps of these ways are chosen: straight to the goal, while the heading turns
    evenly, before it or after it; and turn along the way, walk ahead or backwards, turn.

    Args:
        robot: The robot, for the limits of its footsteps.
        stance: The soles at the beginning.
        goal: Pose of the middle between the soles at the end, in odom.
        duration: Duration of each step [s].
        first: Foot of the first step; None chooses it. While walking it is the foot that landed
            before the last one.
        keep_heading: Whether the robot does not turn along the way, but walks sideways or
            diagonally.
        whole_turns: Whether a goal's heading of more than half a turn from the present one means
            that the robot turns so far.
        room: What may be in the way; None: nothing.

    Returns:
        The footsteps; none if the feet are at the goal already.

    Raises:
        InvalidFootsteps: Stance or goal are no numbers, the goal is too far away, or no way leads
            there.
        WalkInfeasible: Something is in the way.
        RobotConfigError: The robot has no limits of footsteps.
    """
    limits = needed(robot.footsteps, "footsteps")
    _check_poses(stance, goal)
    if first not in (None, *SIDES):
        raise InvalidFootsteps(quantity="first", value=first, limit=" or ".join(SIDES))
    begin = stance.middle
    if not whole_turns:
        goal = Pose(goal.x, goal.y, begin.yaw + wrapped(goal.yaw - begin.yaw))
    if _at(stance, Stance.around(goal, limits.width)) and abs(goal.yaw - begin.yaw) < _REACHED:
        return []
    ways = _ways(begin, goal, room, facing=not keep_heading, whole_turns=whole_turns)
    found = _fewest(robot, limits, stance, ways, first, duration)
    if found is None:  # from feet that stand far apart: first one of them goes beside the other
        side = first or SIDES[0]
        pose = stance.foot(other(side)).moved(0.0, OUTWARD[side] * limits.width)
        step = Footstep(side, *pose, duration)
        beside = stance.after(step)
        ways = _ways(beside.middle, goal, room, facing=not keep_heading, whole_turns=whole_turns)
        rest = _fewest(robot, limits, beside, ways, other(side), duration)
        found = None if rest is None else [step, *rest]
    if found is None:
        raise InvalidFootsteps(
            f"no footsteps lead to x {goal.x:.3f} m, y {goal.y:.3f} m, yaw "
            f"{math.degrees(goal.yaw):.1f} deg from the present stance",
            quantity="goal", value=tuple(goal), limit="a pose that the feet can reach")
    check_footsteps(robot, stance, found)
    return found


def _check_poses(stance: Stance, goal: Pose) -> None:
    for side in SIDES:
        require_numbers(f"the {side} foot", stance.foot(side))
    require_numbers("the goal", goal)
    distance = math.hypot(goal.x - stance.middle.x, goal.y - stance.middle.y)
    if not distance <= _FARTHEST:
        raise InvalidFootsteps(
            f"the goal is {distance:.1f} m away, at most {_FARTHEST:g} m are allowed",
            quantity="distance [m]", value=distance, limit=_FARTHEST)


def _ways(
    begin: Pose, goal: Pose, room: Room | None, *, facing: bool, whole_turns: bool
) -> list[tuple[Pose, ...]]:
    """Return the direct ways that are free; the first free one around something if none is."""
    direct = list(_direct(begin, goal, facing=facing, whole_turns=whole_turns))
    if room is None:
        return direct
    found, blocked = [], None
    for way in direct:
        try:
            room.require_way(way)
            found.append(way)
        except WalkInfeasible as error:
            blocked = blocked or error
    if blocked is None or found:
        return found
    for places in room.detours(begin, goal):
        way = _through(begin, places, goal, facing=facing, whole_turns=whole_turns)
        with suppress(WalkInfeasible):
            room.require_way(way)
            return [way]
    raise blocked


def _through(
    begin: Pose, places: Sequence[Pose], goal: Pose, *, facing: bool, whole_turns: bool
) -> tuple[Pose, ...]:
    """Return a way through places; the robot faces each of them, or keeps its heading."""
    way = [begin]
    for place in (*places, goal):
        x, y, heading = way[-1]
        if facing:
            bearing = math.atan2(place.y - y, place.x - x)
            heading += wrapped(bearing - heading)
            way.append(Pose(x, y, heading))
        way.append(Pose(place.x, place.y, heading))
    heading = way[-1].yaw
    return (*way, goal if whole_turns else Pose(
        goal.x, goal.y, heading + wrapped(goal.yaw - heading)))


def _direct(
    begin: Pose, goal: Pose, *, facing: bool, whole_turns: bool
) -> Iterator[tuple[Pose, ...]]:
    """Yield the direct ways to a goal as places through which the middle goes.

    Args:
        begin: Pose of the middle at the beginning.
        goal: Pose of the middle at the end.
        facing: Whether ways on which the robot turns along the way are among them.
        whole_turns: Whether the goal's heading must not change by whole turns.
    """
    yield (begin, goal)
    yield (begin, Pose(begin.x, begin.y, goal.yaw), goal)
    yield (begin, Pose(goal.x, goal.y, begin.yaw), goal)
    if not facing:
        return
    bearing = math.atan2(goal.y - begin.y, goal.x - begin.x)
    for heading in (bearing, bearing + math.pi):
        turned = Pose(begin.x, begin.y, begin.yaw + wrapped(heading - begin.yaw))
        arrived = Pose(goal.x, goal.y, turned.yaw)
        nearest = turned.yaw + wrapped(goal.yaw - turned.yaw)
        last = Pose(goal.x, goal.y, goal.yaw if whole_turns else nearest)
        yield (begin, turned, arrived, last)
        yield (begin, turned, last)
        yield (begin, arrived, last)


def _fewest(
    robot: RobotConfig, limits: StepLimits, stance: Stance, ways: Sequence[tuple[Pose, ...]],
    first: str | None, duration: float,
) -> list[Footstep] | None:
    """Return the fewest footsteps along one of several ways; None if no way can be gone."""
    found: list[Footstep] | None = None
    for way in ways:
        most = _MOST if found is None else len(found) - 1
        steps = _along(robot, limits, stance, way, first, duration, most)
        if steps is not None:
            found = steps
    return found


def _along(
    robot: RobotConfig, limits: StepLimits, stance: Stance, way: tuple[Pose, ...],
    first: str | None, duration: float, most: int,
) -> list[Footstep] | None:
    """Return the fewest footsteps along a way that keep every limit, at most a number of them."""
    steps: list[Footstep] = []
    for begin, end in itertools.pairwise(way):
        now = stances(stance, steps[-2:])[-1]
        if _at(now, Stance.around(end, limits.width)) and abs(end.yaw - begin.yaw) < _REACHED:
            continue
        feet = SIDES if first is None else (first,)
        piece = _piece(robot, limits, now, begin, end, feet, duration, most - len(steps))
        if piece is None:
            return None
        steps += piece
        first = other(steps[-1].side)
    return steps


def _piece(
    robot: RobotConfig, limits: StepLimits, stance: Stance, begin: Pose, end: Pose,
    feet: Sequence[str], duration: float, most: int,
) -> list[Footstep] | None:
    # Towards the middle of the piece, so that left and right are treated alike.
    half = Pose(begin.x, begin.y, begin.yaw + 0.5 * (end.yaw - begin.yaw))
    way = end.seen_from(half)
    along = max(way.x / limits.ahead, -way.x / limits.back)
    aside, turn = abs(way.y), abs(end.yaw - begin.yaw)
    across = max(aside / (limits.widest - limits.width), turn / limits.turn)
    fewest = max(2, math.ceil(max(along, across) - 1e-9) + 1)
    for count in range(fewest, min(max(2 * fewest, fewest + _LONGER), most) + 1):
        for leading, side in itertools.product(("", *SIDES), feet):
            sides, placed = _placed(limits, begin, end, count, side, leading)
            if fits(robot, stance, sides, placed):
                return [Footstep(foot, x, y, yaw, duration)
                        for foot, (x, y, yaw) in zip(sides, placed.tolist(), strict=True)]
    return None


def _placed(
    limits: StepLimits, begin: Pose, end: Pose, count: int, first: str, leading: str
) -> tuple[list[str], Array]:
    """Place a number of footsteps evenly along a piece; the last two are at its end.

    Args:
        limits: For the distance between the feet.
        begin: Pose of the middle before the piece.
        end: Pose of the middle after it.
        count: Number of footsteps.
        first: Foot of the first step.
        leading: Foot whose steps alone advance sideways and turn; empty if each step does.

    Returns:
        Sides of the footsteps, and x, y [m] and yaw [rad] of the soles, (N, 3).
    """
    sides = [first if index % 2 == 0 else other(first) for index in range(count)]
    advances = np.array([leading in ("", side) for side in sides])
    advances[-1] = False
    # With a foot that leads, its last step may be the last but one or the last but two.
    share = np.cumsum(advances) / advances.sum() if advances.any() else np.ones(count)
    ahead = np.minimum(1.0, np.arange(1, count + 1) / (count - 1))
    way = Pose(end.x, end.y, begin.yaw).seen_from(begin)
    cos, sin = math.cos(begin.yaw), math.sin(begin.yaw)
    x, y = way.x * ahead, way.y * share
    yaw = begin.yaw + share * (end.yaw - begin.yaw)
    aside = 0.5 * limits.width * np.array([OUTWARD[side] for side in sides])
    placed = np.column_stack([
        begin.x + cos * x - sin * y - aside * np.sin(yaw),
        begin.y + sin * x + cos * y + aside * np.cos(yaw), yaw])
    return sides, placed


def _at(stance: Stance, wanted: Stance) -> bool:
    return all(max(map(abs, stance.foot(side).seen_from(wanted.foot(side)))) < _REACHED
               for side in SIDES)
