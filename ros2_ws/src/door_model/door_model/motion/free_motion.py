"""Free motion of many doors at once, with exact derivatives by parameters and start.

The motion is that of eq. (1) without external torque, with the extensions of `Ratios` that real
closers need. It is cut into pieces at its events: where the door turns round, enters a zone or
falls shut. Each piece is smooth, and a few long steps of `collocation` follow it to rounding
errors. docs/free_motion.md derives the equations and explains the symbols.

Free motion depends only on the parameters divided by I_A, so these ratios are the input. K is the
number of doors, N the number of points of a step, U the number of `UNKNOWNS`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike, NDArray

from door_model.door.closer import LIMIT_MARGIN, angle_limits
from door_model.door.ratios import Ratios
from door_model.motion.collocation import MATRIX, POINTS, interpolation
from door_model.motion.free_step import (
    Law,
    Mask,
    Points,
    crossing_before_turn,
    end_at_event,
    first_event,
    newton_matrix,
    solve_step,
)

Index = NDArray[np.int64]

_LONGEST_STEP = 1.2  # longest step [s]
_LONGEST_TRAVEL = 0.8  # largest travel in a step [rad]
_SHARE_OF_SPACE = 0.8  # largest travel in a step / distance to the end of the linkage
_LEAST_SPACE = 0.005  # least distance that is assumed to the end of the linkage [rad]

UNKNOWNS = (*(field.name for field in fields(Ratios)), "theta0", "omega0")
"""Names of the ratios and start values on which a motion depends, in the order of derivatives."""

_OPENING, _CLOSING, _BACKCHECK, _LATCH, _SPRING, _PRELOAD, _FRICTION = range(7)
_BACKCHECK_ANGLE, _LATCH_ANGLE, _THETA0, _OMEGA0 = range(7, 11)


class End(IntEnum):
    """Reason why a motion ends."""

    TIME = 0  # the wanted time or peak was reached
    SHUT = 1  # the door has fallen shut
    STUCK = 2  # friction holds the door
    LINKAGE = 3  # the door has reached an angle at which its linkage does not close


@dataclass(frozen=True)
class _Step:
    """One step of K of the doors: start, points and derivatives.

    Attributes:
        doors: Numbers of the doors (K,).
        start: Times at the start of the step (K,) [s].
        length: Lengths of the step (K,) [s].
        theta: Angles at start and points (N + 1, K) [rad].
        omega: Angular velocities at start and points (N + 1, K) [rad/s].
        rate: Accelerations at the points (N, K) [rad/s^2].
        d_start: Derivatives of `start` by `UNKNOWNS` (U, K); None if derivatives are not wanted.
        d_theta: Derivatives of `theta`, at fixed times after `start` (N + 1, U, K).
        d_omega: Derivatives of `omega`, at fixed times after `start` (N + 1, U, K).
    """

    doors: Index
    start: Array
    length: Array
    theta: Array
    omega: Array
    rate: Array
    d_start: Array | None = None
    d_theta: Array | None = None
    d_omega: Array | None = None


@dataclass(frozen=True)
class FreeMotion:
    """Motions of K doors.

    Attributes:
        peak_time: Times at which the doors first turn round from opening (K,) [s]; NaN for a door
            that does not.
        peak_angle: Angles at the peaks (K,) [rad]; NaN for a door without a peak.
        end_time: Times at which the motions end (K,) [s].
        end_angle: Angles at the ends (K,) [rad].
        end_speed: Angular velocities at the ends (K,) [rad/s].
        end: Reasons for the ends, values of `End` (K,).
        steps: Steps of which the motions consist.
        d_end_time: Derivatives of `end_time` by `UNKNOWNS` (U, K); 0 if derivatives are not wanted.
        d_end_angle: Derivatives of `end_angle` by `UNKNOWNS` (U, K); 0 if not wanted.
    """

    peak_time: Array
    peak_angle: Array
    end_time: Array
    end_angle: Array
    end_speed: Array
    end: Index
    steps: list[_Step]
    d_end_time: Array
    d_end_angle: Array

    def at(self, times: Array) -> tuple[Array, Array]:
        """Return angles [rad] and angular velocities [rad/s] of all doors at times (M,) [s].

        After the end of its motion a door stands still at the end angle.

        Returns:
            Two arrays (M, K).
        """
        count = len(self.end_time)
        theta = np.broadcast_to(self.end_angle, (len(times), count)).copy()
        omega = np.zeros((len(times), count))
        for step in self.steps:
            sample, place = np.nonzero(
                (times[:, None] >= step.start) & (times[:, None] < step.start + step.length)
            )
            weights = interpolation((times[sample] - step.start[place]) / step.length[place])
            door = step.doors[place]
            theta[sample, door] = np.einsum("mn,nm->m", weights, step.theta[:, place])
            omega[sample, door] = np.einsum("mn,nm->m", weights, step.omega[:, place])
        return theta, omega

    def derivatives(self, door: int, times: Array) -> tuple[Array, Array]:
        """Return angles of one door at increasing times, and their derivatives by `UNKNOWNS`.

        Args:
            door: Number of the door.
            times: Times, increasing, (M,) [s].

        Returns:
            Angles (M,) [rad] and derivatives (M, U).
        """
        theta = np.full(len(times), self.end_angle[door])
        slopes = np.zeros((len(times), len(UNKNOWNS)))
        for step, place in self._of(door):
            span = slice(*np.searchsorted(
                times, [step.start[place], step.start[place] + step.length[place]]))
            if span.start == span.stop:
                continue
            assert step.d_theta is not None
            assert step.d_start is not None
            weights = interpolation((times[span] - step.start[place]) / step.length[place])
            theta[span] = weights @ step.theta[:, place]
            omega = weights @ step.omega[:, place]
            slopes[span] = weights @ step.d_theta[:, :, place] - np.outer(
                omega, step.d_start[:, place])
        return theta, slopes

    def _of(self, door: int) -> Iterator[tuple[_Step, int]]:
        """Return the steps of a door, each with the door's place in it."""
        for step in self.steps:
            place = np.flatnonzero(step.doors == door)
            if place.size:
                yield step, int(place[0])


def follow(
    link: ArrayLike,
    ratios: Ratios,
    theta0: ArrayLike,
    omega0: ArrayLike,
    *,
    until: ArrayLike,
    shut_at: ArrayLike = -np.inf,
    to_peak: bool = False,
    exact: bool = False,
) -> FreeMotion:
    """Follow free motions from their starts.

    Args:
        link: Numbers of the linkages in the order of `closer.four_bar`, (6,) or (6, K).
        ratios: Parameters of the doors over I_A.
        theta0: Angles at the start, a number or (K,) [rad].
        omega0: Angular velocities at the start, a number or (K,) [rad/s].
        until: Times until which the motions are followed, a number or (K,) [s].
        shut_at: Angle at which a closing door is shut and stays shut, a number or (K,) [rad].
        to_peak: Whether a motion is followed only until the door first turns round from opening.
        exact: Whether the derivatives are worked out, too.

    Raises:
        DoorModelError: A motion cannot be followed, because a parameter is not a number or huge.
    """
    return _Follower(link, ratios, theta0, omega0, until, shut_at, exact).run(to_peak)


class _Follower:
    """The state of all motions while they are followed."""

    def __init__(
        self,
        link: ArrayLike,
        ratios: Ratios,
        theta0: ArrayLike,
        omega0: ArrayLike,
        until: ArrayLike,
        shut_at: ArrayLike,
        exact: bool,
    ) -> None:
        self.theta, self.omega = (
            np.array(x, dtype=float)
            for x in np.broadcast_arrays(np.atleast_1d(theta0), np.atleast_1d(omega0))
        )
        count = len(self.theta)
        link = np.asarray(link, dtype=float)
        self.link = np.broadcast_to(link.reshape(len(link), -1), (len(link), count))
        low, high = angle_limits(*self.link[:5])
        self.low, self.high = low + LIMIT_MARGIN, high - LIMIT_MARGIN
        self.table = ratios.table(count)
        self.until = np.broadcast_to(np.asarray(until, dtype=float), count)
        self.shut_at = np.broadcast_to(np.asarray(shut_at, dtype=float), count)
        self.time = np.zeros(count)
        self.direction = np.sign(self.omega)
        self.zone = np.zeros(count, dtype=bool)  # in backcheck (opening) or latch (closing)
        self.end = np.full(count, -1)
        self.peak_time, self.peak_angle = np.full(count, np.nan), np.full(count, np.nan)
        self.steps: list[_Step] = []
        self.exact = exact
        unknowns = len(UNKNOWNS)
        self.d_time, self.d_theta, self.d_omega = (np.zeros((unknowns, count)) for _ in range(3))
        self.d_theta[_THETA0] = self.d_omega[_OMEGA0] = 1.0

    def run(self, to_peak: bool) -> FreeMotion:
        """Step until every motion has ended."""
        every = np.arange(len(self.theta))
        self._set_off(every[self.direction == 0.0])
        self._enter(every)
        while True:
            self.end[(self.end < 0) & (self.time >= self.until)] = End.TIME
            if to_peak:
                self.end[(self.end < 0) & ~np.isnan(self.peak_time)] = End.TIME
            doors = np.flatnonzero(self.end < 0)
            if not doors.size:
                break
            self._advance(doors)
        return FreeMotion(
            self.peak_time, self.peak_angle, self.time, self.theta, self.omega, self.end,
            self.steps, self.d_time, self.d_theta)

    def _law(self, doors: Index) -> Law:
        """Return the law of doors in their present direction and zone."""
        table = self.table[:, doors]
        return Law(
            self.link[:, doors], self.low[doors], self.high[doors],
            table[self._regime(doors), np.arange(len(doors))],
            table[_SPRING], table[_PRELOAD], self.direction[doors] * table[_FRICTION])

    def _regime(self, doors: Index) -> Index:
        """Return which of the four damping ratios acts on each door."""
        opens, zone = self.direction[doors] > 0.0, self.zone[doors]
        return np.where(
            opens, np.where(zone, _BACKCHECK, _OPENING), np.where(zone, _LATCH, _CLOSING))

    def _set_off(self, doors: Index) -> None:
        """Set the direction in which doors at rest are pulled, unless friction holds them."""
        law = self._law(doors)
        pull = law.accelerations(self.theta[doors], np.zeros(len(doors)))[0] + law.resistance
        held = np.abs(pull) <= self.table[_FRICTION, doors]
        self.direction[doors] = np.sign(pull)
        self.end[doors[held]] = End.STUCK

    def _enter(self, doors: Index) -> None:
        """Find out whether doors that begin to move in a direction are in a zone."""
        opens = self.direction[doors] > 0.0
        theta, table = self.theta[doors], self.table[:, doors]
        self.zone[doors] = np.where(
            opens, theta >= table[_BACKCHECK_ANGLE], theta <= table[_LATCH_ANGLE])

    def _border(self, doors: Index) -> tuple[Array, Mask]:
        """Return the next angle at which the law changes, and whether the motion ends there."""
        opens, zone, table = self.direction[doors] > 0.0, self.zone[doors], self.table[:, doors]
        ahead = np.where(zone, np.inf, table[_BACKCHECK_ANGLE])
        behind = np.where(zone, -np.inf, table[_LATCH_ANGLE])
        last = np.where(opens, self.high[doors], np.maximum(self.shut_at[doors], self.low[doors]))
        ends = np.where(opens, ahead >= last, behind <= last)
        return np.where(ends, last, np.where(opens, ahead, behind)), ends

    def _advance(self, doors: Index) -> None:
        """Take one step of some doors, which ends early at an event."""
        law, (border, ends) = self._law(doors), self._border(doors)
        theta, omega, sign = self.theta[doors], self.omega[doors], self.direction[doors]
        # Towards the linkage's ends eta grows as 1 / sqrt(distance), so no step may come too close.
        space = np.maximum(np.minimum(theta - law.low, law.high - theta), _LEAST_SPACE)
        travel = np.minimum(_LONGEST_TRAVEL, _SHARE_OF_SPACE * space)
        rate, by_theta, by_omega, _, _ = law.accelerations(theta, omega)
        speed = np.maximum(np.abs(omega), np.sqrt(2.0 * np.abs(rate) * travel))
        length = np.minimum(_LONGEST_STEP, travel / np.maximum(speed, 1e-9))
        jerk = by_theta * omega + by_omega * rate
        length, points = solve_step(law, theta, omega, length, rate, jerk)
        turns, crosses, share = first_event(points, omega, theta, sign, border)
        plain = ~(turns | crosses)
        for part in (plain, ~plain):
            if not part.any():
                continue
            here, its, span, at = doors[part], law.of(part), length[part], points.of(part)
            turned, crossed, edge = turns[part], crosses[part], border[part]
            if not plain[part].all():
                start = theta[part], omega[part]
                span, at = end_at_event(its, *start, span, at, share[part], turned, edge)
                passed = turned & (sign[part] * (at.theta[-1] - edge) > 0.0)
                if passed.any():  # they have passed the border before the turn
                    turned, crossed = turned & ~passed, crossed | passed
                    again = crossing_before_turn(at, span, passed, edge)
                    span, at = end_at_event(its, *start, span, at, again, turned, edge)
            self._move(here, self._record(here, span, at), turned, crossed, edge, ends[part])

    def _record(self, doors: Index, length: Array, points: Points) -> _Step:
        """Store a step, with its derivatives if they are wanted."""
        theta = np.vstack([self.theta[doors], points.theta])
        omega = np.vstack([self.omega[doors], points.omega])
        d_start = d_theta = d_omega = None
        if self.exact:
            d_start = self.d_time[:, doors]
            d_theta, d_omega = self._slopes(doors, length, points)
        step = _Step(doors, self.time[doors], length, theta, omega, points.rate,
                     d_start, d_theta, d_omega)
        self.steps.append(step)
        return step

    def _slopes(
        self, doors: Index, length: Array, points: Points
    ) -> tuple[Array, Array]:
        """Return the derivatives of a step by `UNKNOWNS`, which solve linear equations."""
        unknowns = len(UNKNOWNS)
        d_theta0, d_omega0 = self.d_theta[:, doors], self.d_omega[:, doors]
        forced = np.zeros((POINTS, unknowns, len(doors)))
        own = np.arange(len(doors))
        forced[:, self._regime(doors), own] = -points.eta**2 * points.omega
        forced[:, _SPRING] = -points.eta * points.f
        forced[:, _PRELOAD] = -points.eta
        forced[:, _FRICTION] = -self.direction[doors]
        forced += points.by_theta[:, None, :] * d_theta0
        right = d_omega0 + length * np.einsum("ij,juk->iuk", MATRIX, forced)
        solved = np.linalg.solve(newton_matrix(points, length), right.transpose(2, 0, 1))
        d_omega = solved.transpose(1, 2, 0)
        d_theta = d_theta0 + length * np.einsum("ij,juk->iuk", MATRIX, d_omega)
        return np.concatenate([d_theta0[None], d_theta]), np.concatenate([d_omega0[None], d_omega])

    def _move(
        self, doors: Index, step: _Step, turns: Mask, crosses: Mask, border: Array, ends: Mask
    ) -> None:
        """Go to the end of a step, and change direction or zone at an event."""
        theta, omega = step.theta[-1], step.omega[-1]
        if self.exact:
            self._move_slopes(doors, step, turns, crosses, ends)
        self.time[doors] += step.length
        self.theta[doors] = np.where(crosses, border, theta)
        self.omega[doors] = np.where(turns, 0.0, omega)
        peaks = doors[turns & (self.direction[doors] > 0.0) & np.isnan(self.peak_time[doors])]
        self.peak_time[peaks], self.peak_angle[peaks] = self.time[peaks], self.theta[peaks]
        self.zone[doors[crosses]] = True
        shut = (self.direction[doors] < 0.0) & (border == self.shut_at[doors])
        self.end[doors[crosses & ends & shut]] = End.SHUT
        self.end[doors[crosses & ends & ~shut]] = End.LINKAGE
        turned = doors[turns]
        if turned.size:
            self._set_off(turned)
            self._enter(turned)

    def _move_slopes(
        self, doors: Index, step: _Step, turns: Mask, crosses: Mask, ends: Mask
    ) -> None:
        """Update the derivatives at the end of a step; the time of an event has some, too."""
        assert step.d_theta is not None
        assert step.d_omega is not None
        d_theta, d_omega = step.d_theta[-1], step.d_omega[-1]
        rate, speed = step.rate[-1], step.omega[-1]
        away = d_theta.copy()  # derivative of the distance from the border
        border = np.where(self.direction[doors] > 0.0, _BACKCHECK_ANGLE, _LATCH_ANGLE)
        inner = np.flatnonzero(crosses & ~ends)
        away[border[inner], inner] -= 1.0
        delay = np.zeros_like(d_theta)
        delay[:, turns] = -d_omega[:, turns] / rate[turns]
        delay[:, crosses] = -away[:, crosses] / speed[crosses]
        self.d_time[:, doors] += delay
        self.d_theta[:, doors] = d_theta + speed * delay
        self.d_omega[:, doors] = d_omega + rate * delay
