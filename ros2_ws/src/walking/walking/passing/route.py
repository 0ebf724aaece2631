"""Footsteps through a doorway: the fewest that keep the body clear of walls and leaf.

A beam search: from the stance each foot steps in turn to one of some places beside the other, and
after each step only the stances that promise the fewest further steps are kept. The leaf turns with
the robot: it opens as far as the hand reaches from the shoulder, and never closes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, RobotConfig, StepLimits, needed
from humanoid_motion.leaf import LeafFrame
from numpy.typing import NDArray

from walking.errors import PassageInfeasible
from walking.footsteps.checks import fits
from walking.footsteps.footstep import OUTWARD, Footstep, Pose, Stance, other
from walking.passing.doorway import Doorway
from walking.passing.settings import PassageSettings

OPENING = "opening [m]"
"""Quantity of the error of an opening that is too narrow, whatever the robot does before."""
_AHEAD = (-0.10, 0.0, 0.10, 0.20, math.inf)  # places ahead of the other foot, up to the limit [m]
_ASIDE = (0.0, 0.25, 0.6, 1.0)  # places beside the other foot, from half-sitting's to the widest
_TURNS = (-1.0, -0.5, 0.0, 0.5, 1.0)  # turns against the other foot, as shares of the largest
_BEAM = 150  # number of stances that are kept
_LONGEST = 30  # number of steps after which the search ends
_CELL = np.array([0.03, 0.03, 0.1])  # stances within such cells count as one [m, m, rad]
_WIDE = 0.2  # cost of 0.1 m between the feet beyond half-sitting's, in steps
_LONG = 0.5  # cost of 0.1 m beyond the usual distance ahead, in steps
_TURN = 0.1  # cost of the largest turn between the feet, in steps
_ASIDE_PACE = 0.3  # distance from the middle line that promises one step [m]
_END = 0.03  # distance beyond the leaf's circle at which the search expects to end [m]
_SWAY = 0.5  # sway of the body towards the standing foot, as a share of this foot's distance


@dataclass(frozen=True)
class Route:
    """Footsteps through a doorway. Routes with the same footsteps are equal.

    Attributes:
        footsteps: The footsteps, with the usual duration.
        leaf: Angle of the leaf from which the search took it that each footstep ends, (N,) [rad].
        gap: Smallest distance of the body's rectangle from walls and leaf in a step [m].
        clear: Number of footsteps after which the body is beyond the wall and outside the leaf's
            circle.
    """

    footsteps: tuple[Footstep, ...]
    leaf: Array = field(compare=False)
    gap: float = field(compare=False)
    clear: int


@dataclass(frozen=True)
class _Beam:
    """Stances after some steps, M of them.

    Attributes:
        feet: x, y [m] and yaw [rad] of the soles by side, (M, 3) each.
        angle: Angle of the leaf, (M,) [rad].
        cost: What the steps cost beside their number, (M,).
        gap: Distance of the body from walls and leaf, (M,) [m].
        before: Index of the stance before the last step in its own beam, (M,).
    """

    feet: dict[str, Array]
    angle: Array
    cost: Array
    gap: Array
    before: NDArray[np.int_]

    def chosen(self, which: NDArray[np.int_]) -> _Beam:
        return _Beam({side: self.feet[side][which] for side in SIDES}, self.angle[which],
                     self.cost[which], self.gap[which], self.before[which])

    @property
    def middle(self) -> Array:
        return np.asarray(0.5 * (self.feet["left"] + self.feet["right"]))


def plan_route(
    robot: RobotConfig, doorway: Doorway, stance: Stance, angle: float, target: float,
    shoulder: Array, settings: PassageSettings,
) -> Route:
    """Search the fewest footsteps to a place that is clear of wall and leaf.

    Args:
        robot: The robot, for the limits of its footsteps.
        doorway: The doorway.
        stance: The soles at the beginning.
        angle: Opening angle of the leaf at the beginning [rad].
        target: Opening angle at which the robot passes [rad].
        shoulder: x and y of the right shoulder in the frame of the middle between the soles [m].
        settings: Settings.

    Raises:
        PassageInfeasible: There is no such way.
    """
    _, _, right, left = settings.body
    free, wide = 2.0 * doorway.middle_line(target), left - right
    if free < wide:
        raise PassageInfeasible(
            f"an opening of {doorway.frame.width:.3f} m leaves {free:.2f} m between the leaf at "
            f"{math.degrees(target):.0f} deg and the jamb, the robot is {wide:.2f} m wide",
            quantity=OPENING, value=free, limit=wide)
    found = None
    for first in SIDES:
        one = _search(robot, doorway, stance, angle, target, shoulder, settings, first)
        if one is not None and (found is None or one[0] < found[0]):
            found = one
    if found is None:
        raise PassageInfeasible(
            f"no footsteps lead through the opening of {doorway.frame.width:.3f} m with the leaf "
            f"at {math.degrees(target):.0f} deg", quantity=OPENING, value=doorway.frame.width,
            limit="an opening in which the body keeps its distance")
    _, beams, last, sides = found
    steps, angles, least = [], [], math.inf
    for beam, side in zip(reversed(beams[1:]), reversed(sides), strict=True):
        x, y, yaw = (float(value) for value in beam.feet[side][last])
        steps.append(Footstep(side, x, y, yaw))
        angles.append(float(beam.angle[last]))
        least = min(least, float(beam.gap[last]))
        last = int(beam.before[last])
    steps.reverse()
    return Route(tuple(steps), np.array(angles[::-1]), least, len(steps))


def _search(
    robot: RobotConfig, doorway: Doorway, stance: Stance, angle: float, target: float,
    shoulder: Array, settings: PassageSettings, first: str,
) -> tuple[float, list[_Beam], int, list[str]] | None:
    """Return cost, beams, index of the best stance in the last beam, and sides of the steps."""
    begin = {side: np.array([stance.foot(side)], dtype=float) for side in SIDES}
    beams = [_Beam(begin, np.array([angle]), np.zeros(1), np.full(1, np.inf),
                   np.zeros(1, dtype=int))]
    sides: list[str] = []
    while len(beams) <= _LONGEST:
        side = other(sides[-1]) if sides else first
        sides.append(side)
        grown = _grown(robot, doorway, beams[-1], side, target, shoulder, settings)
        if not len(grown.cost):
            return None
        clear = _clear(doorway, grown.middle, settings)
        if clear.any():
            best = int(np.argmin(np.where(clear, grown.cost, np.inf)))
            return len(sides) + float(grown.cost[best]), [*beams, grown], best, sides
        beams.append(_best(robot, doorway, grown, target, settings))
    return None


def _grown(
    robot: RobotConfig, doorway: Doorway, beam: _Beam, side: str, target: float, shoulder: Array,
    settings: PassageSettings,
) -> _Beam:
    """All stances after one more step that keep their distances."""
    places = _places(robot, side)
    before = np.repeat(np.arange(len(beam.cost)), len(places))
    chosen = np.tile(places, (len(beam.cost), 1))
    still = beam.feet[other(side)][before]
    cos, sin = np.cos(still[:, 2]), np.sin(still[:, 2])
    placed = np.column_stack([
        still[:, 0] + cos * chosen[:, 0] - sin * chosen[:, 1],
        still[:, 1] + sin * chosen[:, 0] + cos * chosen[:, 1], still[:, 2] + chosen[:, 2]])
    feet = {side: placed, other(side): still}
    middle = 0.5 * (placed + still)
    angle = np.maximum(beam.angle[before], _opened(doorway, middle, shoulder, settings.reach))
    angle = angle.clip(None, target)
    swayed = swaying(beam.middle[before], middle, still)
    gap = np.min([
        doorway.wall_gaps(settings.body, swayed, settings.gap),
        doorway.wall_gaps(settings.body, middle, settings.gap),
        doorway.leaf_gaps(settings.body, swayed, 0.5 * (beam.angle[before] + angle)),
        doorway.leaf_gaps(settings.body, middle, angle)], axis=0)
    limits = needed(robot.footsteps, "footsteps")
    cost = beam.cost[before] + _WIDE * (np.abs(chosen[:, 1]) - limits.width).clip(0.0) / 0.1
    cost += _LONG * (chosen[:, 0] - limits.ahead).clip(0.0) / 0.1
    cost += _TURN * np.abs(chosen[:, 2]) / limits.turn
    cost += settings.gap_cost * (1.0 - gap / settings.gap).clip(0.0)
    kept = (gap > 0.0) & (angle - beam.angle[before] <= settings.leaf_step)
    kept &= doorway.wall_gaps(
        robot.soles[side], placed, settings.foot_gap) >= settings.foot_gap
    kept &= doorway.threshold_gaps(robot.soles[side], placed) >= settings.threshold_gap
    grown = _Beam(feet, angle, cost, gap, before)
    return grown.chosen(np.flatnonzero(kept))


def _clear(doorway: Doorway, middle: Array, settings: PassageSettings) -> NDArray[np.bool_]:
    """Whether the body is clear of wall and leaf with its middle at poses (N, 3), (N,)."""
    clear = np.hypot(*(middle[:, :2] - doorway.hinge).T) > doorway.leaf.width
    clear[clear] = doorway.clear_by(settings.body, middle[clear]) >= settings.gap
    return clear


def step_limits(robot: RobotConfig) -> StepLimits:
    """Return where a foot may be placed beside the other in steps that last as long as needed."""
    limits = needed(robot.footsteps, "footsteps")
    return replace(limits, ahead=limits.stride or limits.ahead)


def swaying(before: Array, after: Array, still: Array) -> Array:
    """Place of the body in the middle of steps, where it sways to the standing foot, (N, 3).

    Args:
        before: Middle between the soles before the step: x, y [m] and yaw [rad], (N, 3).
        after: That after the step, (N, 3).
        still: The standing foot, (N, 3).
    """
    mean = 0.5 * (before + after)
    aside = np.column_stack([-np.sin(still[:, 2]), np.cos(still[:, 2])])
    sway = _SWAY * np.einsum("ni,ni->n", still[:, :2] - mean[:, :2], aside)
    mean[:, :2] += sway[:, None] * aside
    return mean


def _opened(doorway: Doorway, middle: Array, shoulder: Array, reach: float) -> Array:
    """Angle of the leaf whose face is at a distance [m] from the shoulder, (N,) [rad]."""
    cos, sin = np.cos(middle[:, 2]), np.sin(middle[:, 2])
    place = middle[:, :2] + np.column_stack([
        cos * shoulder[0] - sin * shoulder[1], sin * shoulder[0] + cos * shoulder[1]])
    offset = place - doorway.hinge
    distance = np.hypot(*offset.T)
    return np.asarray(
        np.arcsin(np.clip(reach / distance, -1.0, 1.0)) - np.arctan2(offset[:, 1], offset[:, 0]))


def _best(
    robot: RobotConfig, doorway: Doorway, grown: _Beam, target: float, settings: PassageSettings
) -> _Beam:
    """The stances that promise the fewest further steps, one of each cell."""
    middle, limits = grown.middle, needed(robot.footsteps, "footsteps")
    leaf, place = LeafFrame(doorway.hinge, target), middle[:, :2]
    left = (doorway.leaf.width + _END - settings.body[0] - leaf.radius(place)).clip(0.0)
    aside = np.abs(leaf.gap(place) - doorway.middle_line(target))
    steps = grown.cost + left / limits.ahead + aside / _ASIDE_PACE
    steps += np.abs(middle[:, 2] + target) / (2.0 * limits.turn)
    order = np.argsort(steps, kind="stable")[: 6 * _BEAM]
    cells = np.hstack([np.round(grown.feet[side][order] / _CELL) for side in SIDES])
    _, first = np.unique(cells, axis=0, return_index=True)
    return grown.chosen(order[np.sort(first)][:_BEAM])


@lru_cache(maxsize=8)
def _places(robot: RobotConfig, side: str) -> Array:
    """Places of a foot in the axes of the other one that keep every limit, (P, 3) [m, m, rad]."""
    still = Pose(0.0, 0.0, 0.0)
    stance, limits = Stance(still, still), step_limits(robot)
    found = []
    for ahead in sorted({min(ahead, limits.ahead) for ahead in _AHEAD}):
        for share in _ASIDE:
            for turn in _TURNS:
                aside = limits.width + share * (limits.widest - limits.width)
                place = np.array([ahead, OUTWARD[side] * aside, turn * limits.turn])
                if fits(robot, stance, [side], place[None], limits):
                    found.append(place)
    return np.array(found)
