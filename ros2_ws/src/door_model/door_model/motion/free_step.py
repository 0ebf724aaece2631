"""One step of free motion: solves the equations of collocation for many doors together.

The equations and their symbols are derived in docs/free_motion.md. K is the number of doors, N the
number of points of a step.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import NDArray

from door_model.door.closer import four_bar
from door_model.errors import DoorModelError
from door_model.motion.collocation import MATRIX, NODES, POINTS, ROUGHNESS, interpolation

Mask = NDArray[np.bool_]

_SHORTEST_STEP = 1e-9  # shortest step that is tried [s]
_ITERATIONS = 25  # largest number of Newton iterations
_CONVERGED = 1e-11  # error of the speeds at which the iteration ends, relative to 1 + speed
_ROUGHEST = 1e-4  # largest last term of a step [rad/s]; peaks are then right to 4e-8 deg
_EVENT_ROUNDS = 8  # largest number of corrections of an event's time
_EVENT_TIME = 1e-10  # error of an event's time at which the corrections end [s]

_UNIT = np.eye(POINTS)
# A D A for a diagonal matrix D, as a linear function of the diagonal; A is the Runge-Kutta matrix.
_TWICE = (MATRIX.T[:, :, None] * MATRIX[:, None, :]).reshape(POINTS, POINTS * POINTS)


@dataclass(frozen=True)
class Law:
    """Eq. (1) for doors that keep their direction and zone.

    Attributes:
        link: Numbers of the linkages, in the order of `closer.four_bar` (6, K).
        low: Smallest angles at which the linkages close (K,) [rad].
        high: Largest angles at which the linkages close (K,) [rad].
        damping: Viscosities that act, over I_A (K,) [1/s].
        spring: Spring coefficients over I_A (K,) [1/s^2].
        preload: Closer torques tau'_c0 over I_A (K,) [1/s^2].
        resistance: Friction over I_A, with the sign of the motion (K,) [1/s^2].
    """

    link: Array
    low: Array
    high: Array
    damping: Array
    spring: Array
    preload: Array
    resistance: Array

    def of(self, part: Any) -> "Law":
        """Return the law of some of the doors."""
        return Law(self.link[:, part], *(
            getattr(self, field.name)[part] for field in fields(self)[1:]))

    def accelerations(self, theta: Array, omega: Array) -> tuple[Array, ...]:
        """Work out the accelerations at angles [rad] and angular velocities [rad/s], each (N, K).

        Beyond the linkage's range, f and eta keep their values at its end.

        Returns:
            Accelerations [rad/s^2], their derivatives by theta and omega, f and eta, each (N, K).
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
    """Values at the points of a step, each (N, K).

    Attributes:
        theta: Opening angles [rad].
        omega: Angular velocities [rad/s].
        rate: Accelerations [rad/s^2].
        by_theta: Derivatives of the accelerations by theta [1/s^2].
        by_omega: Derivatives of the accelerations by omega [1/s].
        f: Angles of the closers' joints [rad].
        eta: Reduction ratios [-].
    """

    theta: Array
    omega: Array
    rate: Array
    by_theta: Array
    by_omega: Array
    f: Array
    eta: Array

    def of(self, part: Any) -> "Points":
        """Return the points of some of the doors."""
        return Points(*(getattr(self, field.name)[:, part] for field in fields(self)))


def newton_matrix(points: Points, length: Array) -> Array:
    """Return the derivative (K, N, N) of a step's equations by the speeds at its points."""
    count = len(length)
    twice = ((length * length * points.by_theta).T @ _TWICE).reshape(count, POINTS, POINTS)
    once = (length * points.by_omega).T[:, None, :] * MATRIX
    return np.asarray(_UNIT - once - twice)


def _solve(law: Law, theta0: Array, omega0: Array, length: Array, first: Array) -> tuple[
    Points, Mask
]:
    """Solve a step by Newton's method from a first guess of the speeds (N, K).

    Returns:
        The points, and for which doors the iteration has not converged (K,).
    """
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
        # Newton's method squares its error, and the correction is the error of the last guess.
        change = np.abs(correction[:, :, 0]).max(axis=1) ** 2
    return points, ~(change < _CONVERGED * scale)


def solve_step(
    law: Law, theta0: Array, omega0: Array, length: Array, rate: Array, jerk: Array
) -> tuple[Array, Points]:
    """Solve a step, which is halved for those doors for which it is too long.

    Args:
        law: Law of the doors.
        theta0: Angles at the start (K,) [rad].
        omega0: Angular velocities at the start (K,) [rad/s].
        length: Wanted lengths of the steps (K,) [s].
        rate: Accelerations at the start (K,) [rad/s^2].
        jerk: Derivatives of the accelerations by time at the start (K,) [rad/s^3].

    Returns:
        Lengths of the steps (K,) [s], and their points.

    Raises:
        DoorModelError: No step is short enough.
    """
    while True:
        time = NODES[:, None] * length
        first = omega0 + time * (rate + 0.5 * time * jerk)
        points, failed = _solve(law, theta0, omega0, length, first)
        # The last term of the polynomial estimates the terms that are left out.
        failed |= np.abs(length * (ROUGHNESS @ points.rate)) > _ROUGHEST
        if not failed.any():
            return length, points
        length = np.where(failed, 0.5 * length, length)
        if not (length > _SHORTEST_STEP).all():
            raise DoorModelError(
                "the motion cannot be followed: a parameter is not a number, or is huge",
                quantity="length of a step [s]", value=float(length.min()), limit=_SHORTEST_STEP)


def first_event(
    points: Points, omega0: Array, theta0: Array, sign: Array, border: Array
) -> tuple[Mask, Mask, Array]:
    """Find the first event of each door in a step.

    A door that turns round and reaches a border counts as turning; the angle at which it turns
    shows whether it has passed the border.

    Args:
        points: Points of the step.
        omega0: Angular velocities at the start (K,) [rad/s].
        theta0: Angles at the start (K,) [rad].
        sign: Directions of the motions (K,).
        border: Angles of the borders (K,) [rad].

    Returns:
        Whether the doors turn round (K,), whether they reach the border (K,), and the approximate
        time of this event as a share of the step (K,).
    """
    turn = _first_below(sign * np.vstack([omega0, points.omega]))
    cross = _first_below(sign * (border - np.vstack([theta0, points.theta])))
    turns = np.isfinite(turn)
    return turns, np.isfinite(cross) & ~turns, np.where(turns, turn, cross)


def crossing_before_turn(points: Points, length: Array, passed: Mask, border: Array) -> Array:
    """Estimate when doors that turn round at the end of a step have passed a border before.

    The acceleration is assumed to be constant, which is a good approximation near the turn.

    Args:
        points: Points of the step.
        length: Length of the step (K,) [s].
        passed: Which doors have passed the border (K,).
        border: Angles of the borders (K,) [rad].

    Returns:
        Time of the crossing as a share of the step (K,); 1 for the other doors.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        left = np.sqrt(2.0 * (border - points.theta[-1]) / points.rate[-1])
        share = 1.0 - left / length
    return np.where(passed, np.clip(np.where(np.isfinite(share), share, 0.5), 0.01, 1.0), 1.0)


def _first_below(values: Array) -> Array:
    """Return the share of the step (K,) at which values at start and points fall below 0."""
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
    """Shorten steps until they end at their events, by Newton's method.

    Args:
        law: Law of the doors.
        theta0: Angles at the start (K,) [rad].
        omega0: Angular velocities at the start (K,) [rad/s].
        length: Lengths of the steps (K,) [s].
        points: Points of the steps.
        share: Approximate times of the events as shares of the steps (K,).
        turns: Whether the event is a turn (K,); else it is a border.
        border: Angles of the borders (K,) [rad].

    Returns:
        Lengths of the shortened steps (K,) [s], and their points.
    """
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
        off = np.where(np.isfinite(off), off, 0.0)  # it only touches the border
        if (np.abs(off) < _EVENT_TIME).all():
            break
        share = np.clip(1.0 + off / length, 0.1, 2.0)
        speeds = np.vstack([omega0, points.omega])
    return length, points


def _root(values: Array, slopes: Array, share: Array) -> Array:
    """Find the zeros (K,) of polynomials near `share`, by two steps of Newton's method.

    Args:
        values: Values of the polynomials at start and points (N + 1, K).
        slopes: Derivatives by the share of the step at start and points (N + 1, K).
        share: First guess, as a share of the step (K,).
    """
    for _ in range(2):
        weights = interpolation(share)
        value, slope = (np.einsum("kn,nk->k", weights, known) for known in (values, slopes))
        with np.errstate(divide="ignore", invalid="ignore"):
            better = share - value / slope
        share = np.where((better > 0.0) & (better < 1.0), better, share)
    return share
