"""The run-up `zmp_limited`: the course of the CoM with the largest ZMP margin.

This time law is not the paper's. The paper's cam curve accelerates only in the first third of the
distance. Here the course y(t) is a quintic spline whose coefficients a linear programme chooses: it
maximises the distance of the ZMP from the soles' edges, less a small price for jerk. The ZMP of the
whole-body motion is linear in the acceleration and nearly linear in place and speed. A few passes
are therefore enough, each linearised about the course of the previous pass.
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

_DEGREE = 5  # of the spline
_COEFFICIENTS = 14  # number of the spline's coefficients
_SAMPLES = 60  # number of times at which the programme checks the ZMP
_PASSES = 3  # number of linearisations in the search for the fastest course
_MOST_JERK = 40.0  # largest jerk, with which the ZMP moves at about 3 m/s [m/s^3]
_JERK_PRICE = 5e-4  # margin that is worth 1 m/s^3 of jerk [m]
_RISE_TIMES = (0.7, 0.9, 1.1, 1.4)  # candidate times until the speed is constant, increasing [s]
_TIE = 1e-4  # margins that differ by less count as equal [m]
# Steps of the ZMP's finite differences in place [m], speed [m/s] and acceleration [m/s^2].
_STEPS = (1e-3, 1e-2, 1e-1)


@dataclass(frozen=True)
class SmoothRunUp:
    """Run-up from rest to a constant speed along a spline, then at constant speed.

    Attributes:
        speed: Speed at the end of the spline [m/s].
        distance: Distance from the start to the nominal contact [m].
        rise: Time until the speed is constant [s].
        course: Distance from the start over time, for times from 0 to `rise` [m].
    """

    speed: float
    distance: float
    rise: float
    course: BSpline

    @property
    def duration(self) -> float:
        """Time from rest to the nominal contact [s]."""
        return self.rise + (self.distance - float(self.course(self.rise))) / self.speed

    def at(self, time: ArrayLike) -> CamSample:
        """Compute displacement and its derivatives at times from the start [s], of any shape."""
        t = np.asarray(time, dtype=float)
        late = t > self.rise
        inside = np.clip(t, 0.0, self.rise)
        s, v, a, jerk = (self.course(inside, order) for order in range(4))
        return CamSample(
            s=np.where(late, s + self.speed * (t - self.rise), s),
            v=np.where(late, self.speed, v),
            a=np.where(late, 0.0, a),
            jerk=np.where(late, 0.0, jerk),
        )


@dataclass(frozen=True)
class Floor:
    """Where a run-up may lead.

    Attributes:
        zmp: y of the ZMP (N,) [m] for places [m], speeds [m/s] and accelerations [m/s^2] of the CoM
            along y, (N,) each.
        edges: Lower and upper y of the soles [m].
        y_hit: y of the CoM at the nominal contact [m].
        highest: Largest y that the legs reach [m].
        steady: Distance at constant speed before the nominal contact [m].
    """

    zmp: Callable[[Array, Array, Array], Array]
    edges: tuple[float, float]
    y_hit: float
    highest: float
    steady: float


def best_run_up(floor: Floor, speed: float) -> tuple[SmoothRunUp, float, float] | None:
    """Find the run-up with the largest ZMP margin to a speed of the CoM at the contact [m/s].

    Returns:
        The run-up, y of its start [m] and the margin [m]; None where no course meets the
        conditions.
    """
    courses = [_Course(rise, floor) for rise in _RISE_TIMES]
    found = []
    for course in courses:
        answer = course.solve(course.guess(speed), _Aim(speed=(speed, speed)))
        if answer is not None:
            found.append((answer.worth, course, answer))
    if not found:
        return None
    # Among courses that differ by less than `_TIE`, the longest is taken; rounding must not decide.
    best = max(worth for worth, _, _ in found)
    _, course, answer = [one for one in found if one[0] > best - _TIE][-1]
    # One more pass, linearised about the found course, where the linear ZMP is nearly exact.
    again = course.solve(answer.coefficients, _Aim(speed=(speed, speed)))
    if again is not None and again.worth > answer.worth:
        answer = again
    y = answer.coefficients
    start = float(y[0])
    law = SmoothRunUp(
        speed, start - floor.y_hit, course.rise, BSpline(course.knots, start - y, _DEGREE))
    return law, start, answer.margin


def fastest_run_up(floor: Floor, margin: float, most: float) -> float:
    """Find the highest speed of the CoM at the contact with a given ZMP margin [m/s].

    Args:
        margin: Required distance of the ZMP from the edges [m].
        most: Upper bound of the search [m/s].

    Returns:
        The speed; 0 where no speed has the margin.
    """
    aim = _Aim(speed=(0.0, most), margin=(margin, margin))
    fastest = 0.0
    for rise in _RISE_TIMES:
        course = _Course(rise, floor)
        about, speed = course.guess(0.5 * most), 0.0
        for _ in range(_PASSES):
            answer = course.solve(about, aim)
            if answer is None:
                break
            about, speed = answer.coefficients, answer.speed
        else:
            fastest = max(fastest, speed)
    return fastest


@dataclass(frozen=True)
class _Aim:
    """Ranges for the linear programme, of which either speed or margin is fixed.

    Attributes:
        speed: Least and largest speed at the end of the course [m/s].
        margin: Least and largest ZMP margin [m]; None means that there is no bound.
    """

    speed: tuple[float, float]
    margin: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True)
class _Answer:
    """Solution of the linear programme.

    Attributes:
        coefficients: Coefficients of the course's spline, (C,) [m].
        speed: Speed at the end of the course [m/s].
        margin: ZMP margin of the course [m].
        worth: Margin less the price of the jerk [m].
    """

    coefficients: Array
    speed: float
    margin: float
    worth: float


class _Course:
    """Courses y(t) of one duration: their spline basis and the linear programme.

    Args:
        rise: Duration of the course [s].
        floor: Where the run-up may lead.
    """

    def __init__(self, rise: float, floor: Floor) -> None:
        inner = np.linspace(0.0, rise, _COEFFICIENTS - _DEGREE + 1)
        ends = np.zeros(_DEGREE)
        self.rise = rise
        self.knots = np.concatenate([ends, inner, ends + rise])
        time = np.linspace(0.0, rise, _SAMPLES)
        basis = BSpline(self.knots, np.eye(_COEFFICIENTS), _DEGREE)
        self.rows = [basis(time, order) for order in range(4)]
        self.range = (floor.y_hit + floor.steady, floor.highest)
        self._zmp, self._edges = floor.zmp, floor.edges

    def guess(self, speed: float) -> Array:
        """Return the coefficients of a simple course to a speed [m/s] within reach, (C,) [m]."""
        low, high = self.range
        middle = np.linspace(0.0, 1.0, _COEFFICIENTS) ** 3 * speed * self.rise / 3.0
        return np.clip(low + middle[-1] - middle, low, high)

    def solve(self, about: Array, aim: _Aim) -> _Answer | None:
        """Find the best course for a ZMP that is linearised about the coefficients `about`."""
        zmp = self._zmp
        y, v, a = (row @ about for row in self.rows[:3])
        at = zmp(y, v, a)
        # The step is backward where a forward one would leave the legs' reach.
        step = np.where(y + _STEPS[0] > self.range[1], -_STEPS[0], _STEPS[0])
        slopes = (
            (zmp(y + step, v, a) - at) / step,
            (zmp(y, v + _STEPS[1], a) - at) / _STEPS[1],
            (zmp(y, v, a + _STEPS[2]) - at) / _STEPS[2],
        )
        linear = np.sum(
            [slope[:, None] * row for slope, row in zip(slopes, self.rows, strict=False)], axis=0)
        x = self._programme(linear, at - linear @ about, aim)
        if x is None:
            return None
        found = x[:_COEFFICIENTS]
        y, v, a, jerk = (row @ found for row in self.rows)
        at = zmp(y, v, a)
        margin = float(edge_margin(at, self._edges))
        return _Answer(
            found, float(x[-1]), margin, margin - _JERK_PRICE * float(np.abs(jerk).max()))

    def _programme(self, linear: Array, offset: Array, aim: _Aim) -> Array | None:
        """Solve the linear programme.

        Args:
            linear: Slope of the ZMP by the coefficients, (N, C).
            offset: ZMP for zero coefficients, (N,) [m].

        Returns:
            Coefficients, margin, jerk and speed of the best course, (C + 3,); None where no
            course meets the constraints.
        """
        place, jerk = self.rows[0], self.rows[3]
        below = np.vstack([
            _beside(linear, margin=1.0), _beside(-linear, margin=1.0), _beside(place),
            _beside(-place), _beside(jerk, jerk=-1.0), _beside(-jerk, jerk=-1.0)])
        low, high = self.range
        right, left = self._edges
        limits = np.concatenate([
            left - offset, offset - right, np.full(_SAMPLES, high), np.full(_SAMPLES, -low),
            np.zeros(2 * _SAMPLES)])
        # The course starts at rest and ends at its place and speed, both without acceleration
        # and jerk.
        equal = np.vstack([
            _beside(row) for row in (
                *(row[:1] for row in self.rows[1:]), place[-1:],
                *(row[-1:] for row in self.rows[2:]))]
            + [_beside(self.rows[1][-1:], speed=1.0)])
        wanted = np.zeros(len(equal))
        wanted[3] = low
        cost = np.zeros(_COEFFICIENTS + 3)
        cost[-3:] = -1.0, _JERK_PRICE, -1.0  # either margin or speed is fixed by its bounds
        answer = linprog(
            cost, A_ub=below, b_ub=limits, A_eq=equal, b_eq=wanted, method="highs",
            bounds=[(None, None)] * _COEFFICIENTS + [aim.margin, (0.0, _MOST_JERK), aim.speed])
        return np.asarray(answer.x) if answer.status == 0 else None


def _beside(rows: Array, margin: float = 0.0, jerk: float = 0.0, speed: float = 0.0) -> Array:
    """Extend rows for the coefficients by factors of margin, jerk and speed, (N, C + 3)."""
    return np.hstack([rows, np.tile([margin, jerk, speed], (len(rows), 1))])
