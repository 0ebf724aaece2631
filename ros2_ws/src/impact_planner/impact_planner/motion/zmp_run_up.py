"""The run-up that the ZMP limits, ours: the course of the CoM with the largest margin.

The paper's cam curve puts all its acceleration into a third of the way. Here the course y(t) is a
quintic spline whose coefficients a linear programme chooses: the largest distance of the ZMP from
the edges of the soles, and of those courses one with a small jerk. The ZMP of the whole-body motion
is linear in the acceleration and nearly so in place and speed, so that a few passes, each linear
about the course of the one before, are enough.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.zmp import edge_margin
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline
from scipy.optimize import linprog

from impact_planner.motion.cam_curve import CamSample

Zmp = Callable[[Array, Array, Array], Array]

_DEGREE = 5
_COEFFICIENTS = 14
_SAMPLES = 60
_PASSES = 3
_MOST_JERK = 40.0  # [m/s^3]; at which the ZMP moves by some 3 m/s
_JERK_PRICE = 5e-4  # [m] of margin for 1 m/s^3
_RISE_TIMES = (0.7, 0.9, 1.1, 1.4)  # tried, rising [s]
_TIE = 1e-4  # [m] of margin
_STEPS = (1e-3, 1e-2, 1e-1)  # [m], [m/s], [m/s^2] of differences of the ZMP


@dataclass(frozen=True)
class SmoothRunUp:
    """Run-up from rest to a constant speed along a spline, then straight on.

    Attributes:
        speed: Speed at the end of the spline [m/s].
        distance: Way from the start to the nominal contact [m].
        rise: Time until the speed is constant [s].
        way: Way over time, for 0 to `rise` [m].
    """

    speed: float
    distance: float
    rise: float
    way: BSpline

    @property
    def duration(self) -> float:
        """Time from rest to the nominal contact [s]."""
        return self.rise + (self.distance - float(self.way(self.rise))) / self.speed

    def at(self, time: ArrayLike) -> CamSample:
        """Way, speed, acceleration and jerk at times from the start [s], any shape."""
        t = np.asarray(time, dtype=float)
        late = t > self.rise
        inside = np.clip(t, 0.0, self.rise)
        s, v, a, jerk = (self.way(inside, order) for order in range(4))
        return CamSample(
            s=np.where(late, s + self.speed * (t - self.rise), s),
            v=np.where(late, self.speed, v),
            a=np.where(late, 0.0, a),
            jerk=np.where(late, 0.0, jerk),
        )


def best_run_up(
    zmp: Zmp,
    edges: tuple[float, float],
    *,
    speed: float,
    y_hit: float,
    highest: float,
    steady: float,
) -> tuple[SmoothRunUp, float, float] | None:
    """The run-up with the largest margin between two edges.

    Args:
        zmp: y of the ZMP (N,) [m] for places, speeds and accelerations of the CoM along y (N,).
        edges: Lower and upper y of the soles [m].
        speed: Of the CoM at the contact, towards -y [m/s].
        y_hit: y of the CoM at the nominal contact [m].
        highest: Largest y that the legs reach [m].
        steady: Way at constant speed before the nominal contact [m].

    Returns:
        The run-up, y of its start [m] and the margin [m]; None where no course fulfils the
        conditions.
    """
    courses = [_Course(rise, y_hit + steady, highest) for rise in _RISE_TIMES]
    found = []
    for course in courses:
        answer = course.solve(zmp, edges, course.guess(speed), _Aim(speed=(speed, speed)))
        if answer is not None:
            found.append((answer.worth, course, answer))
    if not found:
        return None
    # Of courses that differ by less than _TIE the longest, so that no rounding decides.
    best = max(worth for worth, _, _ in found)
    _, course, answer = [one for one in found if one[0] > best - _TIE][-1]
    # Once more, about what was found: there the ZMP is nearly what the programme takes it for.
    again = course.solve(zmp, edges, answer.coefficients, _Aim(speed=(speed, speed)))
    if again is not None and again.worth > answer.worth:
        answer = again
    y = answer.coefficients
    start = float(y[0])
    law = SmoothRunUp(speed, start - y_hit, course.rise, BSpline(course.knots, start - y, _DEGREE))
    return law, start, answer.margin


def fastest_run_up(
    zmp: Zmp,
    edges: tuple[float, float],
    *,
    margin: float,
    most: float,
    y_hit: float,
    highest: float,
    steady: float,
) -> float:
    """Highest speed of the CoM at the contact that leaves a margin; 0 where none does [m/s].

    Args:
        margin: Smallest distance of the ZMP from the edges [m].
        most: Higher speeds are not looked for [m/s].
        zmp, edges, y_hit, highest, steady: As for `best_run_up`.
    """
    aim = _Aim(speed=(0.0, most), margin=(margin, margin))
    fastest = 0.0
    for rise in _RISE_TIMES:
        course = _Course(rise, y_hit + steady, highest)
        about, speed = course.guess(0.5 * most), 0.0
        for _ in range(_PASSES):
            answer = course.solve(zmp, edges, about, aim)
            if answer is None:
                break
            about, speed = answer.coefficients, answer.speed
        else:
            fastest = max(fastest, speed)
    return fastest


@dataclass(frozen=True)
class _Aim:
    """Range of the speed at the end [m/s] and of the margin [m]: one of them is fixed."""

    speed: tuple[float, float]
    margin: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True)
class _Answer:
    """Coefficients of a course (C,), its speed [m/s], margin [m], and that less jerk's price."""

    coefficients: Array
    speed: float
    margin: float
    worth: float


class _Course:
    """A course y(t) of one duration: its spline and the linear programme."""

    def __init__(self, rise: float, y_end: float, highest: float) -> None:
        inner = np.linspace(0.0, rise, _COEFFICIENTS - _DEGREE + 1)
        ends = np.zeros(_DEGREE)
        self.rise = rise
        self.knots = np.concatenate([ends, inner, ends + rise])
        time = np.linspace(0.0, rise, _SAMPLES)
        basis = BSpline(self.knots, np.eye(_COEFFICIENTS), _DEGREE)
        self.rows = [basis(time, order) for order in range(4)]
        self.range = (y_end, highest)

    def guess(self, speed: float) -> Array:
        """Coefficients of a plain course to the speed, within reach, (C,)."""
        low, high = self.range
        middle = np.linspace(0.0, 1.0, _COEFFICIENTS) ** 3 * speed * self.rise / 3.0
        return np.clip(low + middle[-1] - middle, low, high)

    def solve(
        self, zmp: Zmp, edges: tuple[float, float], about: Array, aim: _Aim
    ) -> _Answer | None:
        """The best course where the ZMP is taken as linear about another."""
        y, v, a = (row @ about for row in self.rows[:3])
        at = zmp(y, v, a)
        step = np.where(y + _STEPS[0] > self.range[1], -_STEPS[0], _STEPS[0])  # within reach
        slopes = (
            (zmp(y + step, v, a) - at) / step,
            (zmp(y, v + _STEPS[1], a) - at) / _STEPS[1],
            (zmp(y, v, a + _STEPS[2]) - at) / _STEPS[2],
        )
        linear = np.sum(
            [slope[:, None] * row for slope, row in zip(slopes, self.rows, strict=False)], axis=0)
        x = self._programme(linear, at - linear @ about, edges, aim)
        if x is None:
            return None
        found = x[:_COEFFICIENTS]
        y, v, a, jerk = (row @ found for row in self.rows)
        at = zmp(y, v, a)
        margin = float(edge_margin(at, edges))
        return _Answer(
            found, float(x[-1]), margin, margin - _JERK_PRICE * float(np.abs(jerk).max()))

    def _programme(
        self, linear: Array, offset: Array, edges: tuple[float, float], aim: _Aim
    ) -> Array | None:
        """Coefficients, margin, jerk, speed of the best course (C + 3,); None: there is none."""
        place, jerk = self.rows[0], self.rows[3]
        below = np.vstack([
            _beside(linear, margin=1.0), _beside(-linear, margin=1.0), _beside(place),
            _beside(-place), _beside(jerk, jerk=-1.0), _beside(-jerk, jerk=-1.0)])
        low, high = self.range
        limits = np.concatenate([
            edges[1] - offset, offset - edges[0], np.full(_SAMPLES, high), np.full(_SAMPLES, -low),
            np.zeros(2 * _SAMPLES)])
        # From rest, without acceleration and jerk; to the speed likewise.
        equal = np.vstack([
            _beside(row) for row in (
                *(row[:1] for row in self.rows[1:]), place[-1:],
                *(row[-1:] for row in self.rows[2:]))]
            + [_beside(self.rows[1][-1:], speed=1.0)])
        wanted = np.zeros(len(equal))
        wanted[3] = low
        cost = np.zeros(_COEFFICIENTS + 3)
        cost[-3:] = -1.0, _JERK_PRICE, -1.0  # one of margin and speed is fixed
        answer = linprog(
            cost, A_ub=below, b_ub=limits, A_eq=equal, b_eq=wanted, method="highs",
            bounds=[(None, None)] * _COEFFICIENTS + [aim.margin, (0.0, _MOST_JERK), aim.speed])
        return np.asarray(answer.x) if answer.status == 0 else None


def _beside(rows: Array, margin: float = 0.0, jerk: float = 0.0, speed: float = 0.0) -> Array:
    """Rows of the coefficients with their factors of margin, jerk and speed, (N, C + 3)."""
    return np.hstack([rows, np.tile([margin, jerk, speed], (len(rows), 1))])
