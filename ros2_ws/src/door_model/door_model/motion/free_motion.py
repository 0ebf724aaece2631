"""Free motion of many doors at once, with its exact derivatives by parameters and start.

Eq. (1) without external torque, and what real closers add to it (`Ratios`). Each motion is cut
where its law changes: where the door turns round, enters a zone or falls shut. Between the cuts
it is smooth, and a few long steps of `collocation` follow it to rounding errors.

Free motion depends on the parameters over I_A alone, so these ratios are what is given.
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

_LONGEST_STEP = 1.2  # [s]
_LONGEST_WAY = 0.8  # [rad] in a step
_SHARE_OF_SPACE = 0.8  # of the way to the end of the linkage
_LEAST_SPACE = 0.005  # [rad]



UNKNOWNS = (*(field.name for field in fields(Ratios)), "theta0", "omega0")
"""What a motion depends on: the order of its derivatives."""

_OPENING, _CLOSING, _BACKCHECK, _LATCH, _SPRING, _PRELOAD, _FRICTION = range(7)
_BACKCHECK_ANGLE, _LATCH_ANGLE, _THETA0, _OMEGA0 = range(7, 11)


class End(IntEnum):
    """Why a motion was followed no further."""

    TIME = 0  # as far as it was asked for
    SHUT = 1  # the door has fallen shut
    STUCK = 2  # friction holds it
    LINKAGE = 3  # it came to the end of the angles at which its linkage closes


@dataclass(frozen=True)
class _Step:
    """One step of some doors: start, points and derivatives.

    Attributes:
        doors: Which ones (K,).
        start: Times at which it starts (K,) [s].
        length: (K,) [s].
        theta: Start and points (N + 1, K) [rad].
        omega: The same [rad/s].
        rate: Accelerations at the points (N, K) [rad/s^2].
        d_start: Derivatives of `start` by `UNKNOWNS` (U, K); None where they were not asked for.
        d_theta: Derivatives of `theta` at times from `start` on (N + 1, U, K).
        d_omega: The same of `omega`.
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
        peak_time: When each first turns round from opening (K,) [s]; NaN if it does not.
        peak_angle: The angle there (K,) [rad].
        end_time: Until when each is known (K,) [s].
        end_angle: The angle there (K,) [rad].
        end_speed: The angular velocity there (K,) [rad/s].
        end: Why it ends there (K,), of `End`.
        steps: What the motions consist of.
        d_end_time: Derivatives of `end_time` by `UNKNOWNS` (U, K); 0 where they were not asked for.
        d_end_angle: The same of `end_angle`.
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
        """Angles [rad] and angular velocities [rad/s] of all doors at times (M,), each (M, K).

        Before its start and after its end a door stands as it does then.
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
        """Angles (M,) [rad] of one door at rising times, and their slopes by `UNKNOWNS` (M, U)."""
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
        """Steps of a door, and its place among the doors of each."""
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
    """Free motions from their starts.

    Args:
        link: Numbers of the linkages in the order of `closer.four_bar`, (6,) or (6, K).
        ratios: The parameters.
        theta0: Angles at the start, a number or (K,) [rad].
        omega0: Angular velocities there [rad/s].
        until: Times up to which to follow [s].
        shut_at: A door that closes to this angle is shut and stays so [rad].
        to_peak: Follow each door only until it first turns round from opening.
        exact: Work out the derivatives as well.
    """
    return _Follower(link, ratios, theta0, omega0, until, shut_at, exact).run(to_peak)


class _Follower:
    """State of all motions while they are followed."""

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
        """Step until every door has come to its end."""
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
        """The law of doors in their present direction and zone."""
        table = self.table[:, doors]
        return Law(
            self.link[:, doors], self.low[doors], self.high[doors],
            table[self._regime(doors), np.arange(len(doors))],
            table[_SPRING], table[_PRELOAD], self.direction[doors] * table[_FRICTION])

    def _regime(self, doors: Index) -> Index:
        """Which damping acts."""
        opens, zone = self.direction[doors] > 0.0, self.zone[doors]
        return np.where(
            opens, np.where(zone, _BACKCHECK, _OPENING), np.where(zone, _LATCH, _CLOSING))

    def _set_off(self, doors: Index) -> None:
        """Give doors at rest the direction in which they are pulled, unless friction holds them."""
        law = self._law(doors)
        pull = law.accelerations(self.theta[doors], np.zeros(len(doors)))[0] + law.resistance
        held = np.abs(pull) <= self.table[_FRICTION, doors]
        self.direction[doors] = np.sign(pull)
        self.end[doors[held]] = End.STUCK

    def _enter(self, doors: Index) -> None:
        """Find the zone of doors that begin to move in a direction."""
        opens = self.direction[doors] > 0.0
        theta, table = self.theta[doors], self.table[:, doors]
        self.zone[doors] = np.where(
            opens, theta >= table[_BACKCHECK_ANGLE], theta <= table[_LATCH_ANGLE])

    def _border(self, doors: Index) -> tuple[Array, Mask]:
        """Angle at which the law changes next in the same direction, and whether the door ends."""
        opens, zone, table = self.direction[doors] > 0.0, self.zone[doors], self.table[:, doors]
        ahead = np.where(zone, np.inf, table[_BACKCHECK_ANGLE])
        behind = np.where(zone, -np.inf, table[_LATCH_ANGLE])
        last = np.where(opens, self.high[doors], np.maximum(self.shut_at[doors], self.low[doors]))
        ends = np.where(opens, ahead >= last, behind <= last)
        return np.where(ends, last, np.where(opens, ahead, behind)), ends

    def _advance(self, doors: Index) -> None:
        """One step of some doors, which ends early where their law changes."""
        law, (border, ends) = self._law(doors), self._border(doors)
        theta, omega, sign = self.theta[doors], self.omega[doors], self.direction[doors]
        # eta grows as 1 / sqrt(distance) towards the linkage's ends: no step comes too close.
        space = np.maximum(np.minimum(theta - law.low, law.high - theta), _LEAST_SPACE)
        way = np.minimum(_LONGEST_WAY, _SHARE_OF_SPACE * space)
        rate, by_theta, by_omega, _, _ = law.accelerations(theta, omega)
        speed = np.maximum(np.abs(omega), np.sqrt(2.0 * np.abs(rate) * way))
        length = np.minimum(_LONGEST_STEP, way / np.maximum(speed, 1e-9))
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
                if passed.any():  # the border before the turn
                    turned, crossed = turned & ~passed, crossed | passed
                    again = crossing_before_turn(at, span, passed, edge)
                    span, at = end_at_event(its, *start, span, at, again, turned, edge)
            self._move(here, self._record(here, span, at), turned, crossed, edge, ends[part])

    def _record(self, doors: Index, length: Array, points: Points) -> _Step:
        """Keep a step, with its derivatives if they are wanted."""
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
        """Derivatives of a step by `UNKNOWNS`: the linear equations that its points fulfil."""
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
        """Go to the end of a step, and over to another law where it says so."""
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
        """Derivatives at the end of a step, whose time depends on the unknowns at an event."""
        assert step.d_theta is not None
        assert step.d_omega is not None
        d_theta, d_omega = step.d_theta[-1], step.d_omega[-1]
        rate, speed = step.rate[-1], step.omega[-1]
        away = d_theta.copy()  # of the angle from the border
        border = np.where(self.direction[doors] > 0.0, _BACKCHECK_ANGLE, _LATCH_ANGLE)
        inner = np.flatnonzero(crosses & ~ends)
        away[border[inner], inner] -= 1.0
        delay = np.zeros_like(d_theta)
        delay[:, turns] = -d_omega[:, turns] / rate[turns]
        delay[:, crosses] = -away[:, crosses] / speed[crosses]
        self.d_time[:, doors] += delay
        self.d_theta[:, doors] = d_theta + speed * delay
        self.d_omega[:, doors] = d_omega + rate * delay
