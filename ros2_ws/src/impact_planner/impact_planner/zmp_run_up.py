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
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline
from scipy.optimize import linprog

from .cam_curve import CamSample

Array = NDArray[np.float64]
Zmp = Callable[[Array, Array, Array], Array]

_DEGREE = 5
_COEFFICIENTS = 14
_SAMPLES = 60
_PASSES = 3
_MOST_JERK = 40.0  # [m/s^3]; at which the ZMP moves by some 3 m/s
_JERK_PRICE = 5e-4  # [m] of margin for 1 m/s^3
_RISE_TIMES = (0.7, 0.9, 1.1, 1.4)  # tried [s]
_PENDULUM = 0.08  # height over gravity [s^2]: of a first guess
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
) -> tuple[SmoothRunUp, float] | None:
    """The run-up with the largest margin between two edges.

    Args:
        zmp: y of the ZMP (N,) [m] for places, speeds and accelerations of the CoM along y (N,).
        edges: Lower and upper y of the soles [m].
        speed: Of the CoM at the contact, towards -y [m/s].
        y_hit: y of the CoM at the nominal contact [m].
        highest: Largest y that the legs reach [m].
        steady: Way at constant speed before the nominal contact [m].

    Returns:
        The run-up and y of its start [m]; None where no course fulfils the conditions.
    """
    found = []
    for rise in _RISE_TIMES:
        course = _Course(rise, speed, y_hit + steady, highest)
        answer = course.solve(zmp, edges)
        if answer is not None:
            found.append((answer[1], rise, answer[0], course.knots))
    if not found:
        return None
    _, rise, y, knots = max(found, key=lambda one: one[0])
    start = float(y[0])
    law = SmoothRunUp(speed, start - y_hit, rise, BSpline(knots, start - y, _DEGREE))
    return law, start


class _Course:
    """A course y(t) of one duration: its spline and the linear programme."""

    def __init__(self, rise: float, speed: float, y_end: float, highest: float) -> None:
        inner = np.linspace(0.0, rise, _COEFFICIENTS - _DEGREE + 1)
        ends = np.zeros(_DEGREE)
        self.knots = np.concatenate([ends, inner, ends + rise])
        time = np.linspace(0.0, rise, _SAMPLES)
        basis = BSpline(self.knots, np.eye(_COEFFICIENTS), _DEGREE)
        self.rows = [basis(time, order) for order in range(4)]
        # From rest, without acceleration and jerk; to the speed likewise.
        start, end = [row[0] for row in self.rows[1:]], [row[-1] for row in self.rows]
        self.equal = np.array([*start, *end])
        self.wanted = np.array([0.0, 0.0, 0.0, y_end, -speed, 0.0, 0.0])
        self.range = (y_end, highest)

    def solve(self, zmp: Zmp, edges: tuple[float, float]) -> tuple[Array, float] | None:
        """Coefficients of the course and what it is worth, margin less jerk's price [m]."""
        ones = np.ones(_SAMPLES)
        slopes, offset = (ones, 0.0 * ones, -_PENDULUM * ones), 0.0 * ones
        for _ in range(_PASSES):
            found = self._programme(slopes, offset, edges)
            if found is None:
                return None
            answer = found
            y, v, a = (row @ answer for row in self.rows[:3])
            at = zmp(y, v, a)
            step = np.where(y + _STEPS[0] > self.range[1], -_STEPS[0], _STEPS[0])  # within reach
            slopes = (
                (zmp(y + step, v, a) - at) / step,
                (zmp(y, v + _STEPS[1], a) - at) / _STEPS[1],
                (zmp(y, v, a + _STEPS[2]) - at) / _STEPS[2],
            )
            offset = at - slopes[0] * y - slopes[1] * v - slopes[2] * a
        margin = float(min((edges[1] - at).min(), (at - edges[0]).min()))
        jerk = float(np.abs(self.rows[3] @ answer).max())
        return answer, margin - _JERK_PRICE * jerk

    def _programme(
        self, slopes: tuple[Array, ...], offset: Array, edges: tuple[float, float]
    ) -> Array | None:
        """Coefficients of the best course where the ZMP is linear; None where there is none."""
        zmp = np.sum(
            [slope[:, None] * row for slope, row in zip(slopes, self.rows, strict=False)], axis=0)
        place, jerk = self.rows[0], self.rows[3]
        one, none = np.ones((_SAMPLES, 1)), np.zeros((_SAMPLES, 1))
        below = np.vstack([
            np.hstack([zmp, one, none]), np.hstack([-zmp, one, none]),
            np.hstack([place, none, none]), np.hstack([-place, none, none]),
            np.hstack([jerk, none, -one]), np.hstack([-jerk, none, -one]),
        ])
        low, high = self.range
        limits = np.concatenate([
            edges[1] - offset, offset - edges[0], np.full(_SAMPLES, high), np.full(_SAMPLES, -low),
            np.zeros(2 * _SAMPLES)])
        cost = np.zeros(_COEFFICIENTS + 2)
        cost[-2:] = -1.0, _JERK_PRICE
        answer = linprog(
            cost, A_ub=below, b_ub=limits, A_eq=np.hstack([self.equal, np.zeros((7, 2))]),
            b_eq=self.wanted, bounds=[(None, None)] * (_COEFFICIENTS + 1) + [(0.0, _MOST_JERK)],
            method="highs")
        return np.asarray(answer.x[:_COEFFICIENTS]) if answer.status == 0 else None
