"""One step of free motion: the equations of `collocation` for many doors, solved together."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import NDArray

from door_model.door.closer import four_bar
from door_model.errors import DoorModelError
from door_model.motion.collocation import MATRIX, NODES, POINTS, ROUGHNESS, interpolation

Mask = NDArray[np.bool_]

_SHORTEST_STEP = 1e-9  # [s]
_ITERATIONS = 25
_CONVERGED = 1e-11  # of the speeds [rad/s]
_ROUGHEST = 1e-4  # [rad/s]; peaks of 3,000 random doors are then right to 4e-8 deg
_EVENT_ROUNDS = 8
_EVENT_TIME = 1e-10  # [s]

_UNIT = np.eye(POINTS)
# The matrix on both sides of a diagonal one, as a linear function of the diagonal.
_TWICE = (MATRIX.T[:, :, None] * MATRIX[:, None, :]).reshape(POINTS, POINTS * POINTS)


@dataclass(frozen=True)
class Law:
    """Eq. (1) for doors that keep their direction and zone; each (K,)."""

    link: Array  # (6, K), as `four_bar` takes them
    low: Array
    high: Array
    damping: Array
    spring: Array
    preload: Array
    resistance: Array  # friction, with the sign of the motion

    def of(self, part: Any) -> "Law":
        """The law of some of the doors."""
        return Law(self.link[:, part], *(
            getattr(self, field.name)[part] for field in fields(self)[1:]))

    def accelerations(self, theta: Array, omega: Array) -> tuple[Array, ...]:
        """Acceleration, its slopes by theta and omega, then f and eta; each (N, K).

        Beyond the linkage its end is held.
        """
        held = np.minimum(np.maximum(theta, self.low), self.high)
        f, eta, bend = four_bar(held, *self.link)
        bend = np.where(held == theta, bend, 0.0)
        drag = self.damping * eta
        torque = drag * omega + self.spring * f + self.preload
        by_theta = bend * torque + eta * (self.damping * bend * omega + self.spring * eta)
        return -eta * torque - self.resistance, -by_theta, -drag * eta, f, eta


@dataclass(frozen=True)
class Points:
    """What is known at the points of a step; each (N, K)."""

    theta: Array
    omega: Array
    rate: Array
    by_theta: Array
    by_omega: Array
    f: Array
    eta: Array

    def of(self, part: Any) -> "Points":
        """The points of some of the doors."""
        return Points(*(getattr(self, field.name)[:, part] for field in fields(self)))


def newton_matrix(points: Points, length: Array) -> Array:
    """Derivative (K, N, N) of the equations of a step by the speeds at its points."""
    count = len(length)
    twice = ((length * length * points.by_theta).T @ _TWICE).reshape(count, POINTS, POINTS)
    once = (length * points.by_omega).T[:, None, :] * MATRIX
    return np.asarray(_UNIT - once - twice)


def _solve(law: Law, theta0: Array, omega0: Array, length: Array, first: Array) -> tuple[
    Points, Mask
]:
    """Points of a step by Newton's method from a first guess of the speeds, and where it failed."""
    omega = first
    scale = 1.0 + np.abs(omega0)
    change = np.full(len(length), np.inf)
    for _ in range(_ITERATIONS):
        theta = theta0 + length * (MATRIX @ omega)
        rate, by_theta, by_omega, f, eta = law.accelerations(theta, omega)
        points = Points(theta, omega, rate, by_theta, by_omega, f, eta)
        if (change < _CONVERGED * scale).all():
            break
        residual = omega - omega0 - length * (MATRIX @ rate)
        correction = np.linalg.solve(newton_matrix(points, length), residual.T[:, :, None])
        omega = omega - correction[:, :, 0].T
        # Newton's method squares its error: the correction says how far the last guess was off.
        change = np.abs(correction[:, :, 0]).max(axis=1) ** 2
    return points, ~(change < _CONVERGED * scale)


def solve_step(
    law: Law, theta0: Array, omega0: Array, length: Array, rate: Array, jerk: Array
) -> tuple[Array, Points]:
    """Points of a step that is halved for doors that it is too long for."""
    while True:
        time = NODES[:, None] * length
        first = omega0 + time * (rate + 0.5 * time * jerk)
        points, failed = _solve(law, theta0, omega0, length, first)
        # What the polynomial's last term adds to the speed tells what the next ones would.
        failed |= np.abs(length * (ROUGHNESS @ points.rate)) > _ROUGHEST
        if not failed.any():
            return length, points
        length = np.where(failed, 0.5 * length, length)
        if not (length > _SHORTEST_STEP).all():
            raise DoorModelError("the motion cannot be followed: a parameter is no number or huge",
                                 value=float(length.min()), limit=_SHORTEST_STEP)


def first_event(
    points: Points, omega0: Array, theta0: Array, sign: Array, border: Array
) -> tuple[Mask, Mask, Array]:
    """Which doors turn round in a step, which reach a border, and at what share of it, roughly.

    A door that does both counts as turning: where it turns tells whether it passed the border.
    """
    turn = _first_below(sign * np.vstack([omega0, points.omega]))
    cross = _first_below(sign * (border - np.vstack([theta0, points.theta])))
    turns = np.isfinite(turn)
    return turns, np.isfinite(cross) & ~turns, np.where(turns, turn, cross)


def crossing_before_turn(points: Points, length: Array, passed: Mask, border: Array) -> Array:
    """Share of a step (K,) at which doors that turn at its end passed a border, roughly; else 1.

    The acceleration is taken as constant, which is best near the turn, where a straight line
    would be worst.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        left = np.sqrt(2.0 * (border - points.theta[-1]) / points.rate[-1])
        share = 1.0 - left / length
    return np.where(passed, np.clip(np.where(np.isfinite(share), share, 0.5), 0.01, 1.0), 1.0)


def _first_below(values: Array) -> Array:
    """Place (K,) in 0 .. 1 at which values at start and points (N + 1, K) first fall below 0."""
    below = values[1:] <= 0.0
    point = np.argmax(below, axis=0)
    column = np.arange(values.shape[1])
    before, after = values[point, column], values[point + 1, column]
    left = np.where(point > 0, NODES[point - 1], 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        part = np.where(np.isfinite(before), before / (before - after), 0.0)
    place = left + np.clip(part, 0.0, 1.0) * (NODES[point] - left)
    return np.where(below.any(axis=0), np.maximum(place, 1e-6), np.inf)


def end_at_event(
    law: Law, theta0: Array, omega0: Array, length: Array, points: Points, share: Array,
    turns: Mask, border: Array,
) -> tuple[Array, Points]:
    """Shorten steps until they end at their events, by Newton's method."""
    speeds = np.vstack([omega0, points.omega])
    values = np.where(turns, speeds, np.vstack([theta0, points.theta]) - border)
    rates = np.vstack([law.accelerations(theta0, omega0)[0], points.rate])
    slopes = length * np.where(turns, rates, speeds)
    share = _root(values, slopes, share)
    for _ in range(_EVENT_ROUNDS):
        weights = interpolation(np.ravel(share[:, None] * NODES)).reshape(-1, POINTS, POINTS + 1)
        length = share * length
        points, _ = _solve(law, theta0, omega0, length, np.einsum("kin,nk->ik", weights, speeds))
        theta, omega, rate = points.theta[-1], points.omega[-1], points.rate[-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.where(turns, -omega / rate, (border - theta) / omega)
        off = np.where(np.isfinite(off), off, 0.0)  # it only just touches: no better place
        if (np.abs(off) < _EVENT_TIME).all():
            break
        share = np.clip(1.0 + off / length, 0.1, 2.0)
        speeds = np.vstack([omega0, points.omega])
    return length, points


def _root(values: Array, slopes: Array, share: Array) -> Array:
    """Places (K,) near `share` at which polynomials are 0, by Newton's method.

    Args:
        values: At start and points (N + 1, K).
        slopes: By the share of the step, there too (N + 1, K).
        share: First guess (K,).
    """
    for _ in range(2):
        weights = interpolation(share)
        value, slope = (np.einsum("kn,nk->k", weights, known) for known in (values, slopes))
        with np.errstate(divide="ignore", invalid="ignore"):
            better = share - value / slope
        share = np.where((better > 0.0) & (better < 1.0), better, share)
    return share
