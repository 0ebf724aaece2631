"""Motion of many doors at once by eq. (1), with derivatives by parameters and start.

A motion is cut into pieces at its events: where the door turns round, enters a zone or falls shut.
Within a piece it is smooth, and the method of SciPy's `DOP853` follows all doors together, each
with steps of its own length (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I,
section II.5). docs/free_motion.md explains equations and symbols.

Free motion depends only on the parameters divided by I_A, so these ratios are the input. K is the
number of doors, U the number of `UNKNOWNS`, or 0 where derivatives are not wanted. The state of a
door has two rows, angle and angular velocity, and 1 + U columns, the value and its derivatives.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import DOP853

from door_model.door.closer import LIMIT_MARGIN, angle_limits, four_bar
from door_model.door.ratios import Ratios
from door_model.errors import DoorModelError

Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

_TOLERANCE = 1e-8  # error of a step [rad], [rad/s], absolute and relative
_FIRST_STEP = 0.02  # length of the first step that is tried [s]
_LONGEST_STEP = 0.5  # longest step [s]
_LONGEST_DRIVEN_STEP = 0.05  # longest step under an external torque, which may be short [s]
_SHORTEST_STEP = 1e-13  # shortest step that is tried [s]
_INSTANT = 1e-9  # friction holds a door that moves for no longer between two turns [s]
_SHARE_OF_SPACE = 0.8  # largest travel in a step / distance to the end of the linkage
_LEAST_SPACE = 0.005  # least distance that is assumed to the end of the linkage [rad]
_HALVINGS = 36  # bisections that find the time of an event in a step

_STAGES = len(DOP853.B) + 1  # stages of a step; the last one is the slope at its end
_TABLEAU = [*DOP853.A[1:], DOP853.B, *DOP853.A_EXTRA]
_SHARES = [*DOP853.C[1:], 1.0, *DOP853.C_EXTRA]

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
class _Law:
    """Eq. (1) for doors that keep their direction and zone.

    Attributes:
        link: Numbers of the linkages, in the order of `closer.four_bar` (6, K).
        low: Smallest angles at which the linkages close (K,) [rad].
        high: Largest angles at which the linkages close (K,) [rad].
        table: Ratios (9, K), as in `Ratios.table`.
        direction: Signs of the motions (K,).
        regime: Row of the damping ratio that acts (K,).
        damping: This ratio (K,) [1/s].
        torque: External torque over I_A at times (K,) [1/s^2]; None for free doors.
    """

    link: Array
    low: Array
    high: Array
    table: Array
    direction: Array
    regime: Index
    damping: Array
    torque: Callable[[float], float] | None

    def slopes(self, state: Array, time: Array) -> Array:
        """Differentiate states (2, 1 + U, K) at times (K,) [s] by time.

        Beyond the linkage's range, f and eta keep their values at its end.
        """
        theta, omega = state[:, 0]
        held = np.minimum(np.maximum(theta, self.low), self.high)
        f, eta, bend = four_bar(held, *self.link)
        drag = self.damping * eta
        torque = drag * omega + self.table[_SPRING] * f + self.table[_PRELOAD]
        found = np.empty_like(state)
        found[0] = state[1]
        found[1, 0] = -eta * torque - self.direction * self.table[_FRICTION]
        if self.torque is not None:
            found[1, 0] += [self.torque(now) for now in time.tolist()]
        if state.shape[1] > 1:
            bend = np.where(held == theta, bend, 0.0)
            by_theta = bend * torque + eta * (
                self.damping * bend * omega + self.table[_SPRING] * eta)
            found[1, 1:] = -by_theta * state[0, 1:] - drag * eta * state[1, 1:]
            forced = found[1, 1:]
            forced[self.regime, np.arange(len(theta))] -= eta**2 * omega
            forced[_SPRING] -= eta * f
            forced[_PRELOAD] -= eta
            forced[_FRICTION] -= self.direction
        return found


@dataclass(frozen=True)
class _Step:
    """One step of some of the doors.

    Attributes:
        doors: Numbers of the doors (K,).
        start: Times at the start of the step (K,) [s].
        d_start: Derivatives of `start` by `UNKNOWNS` (U, K).
        length: Lengths of the step (K,) [s]; less than `scale` if it ends at an event.
        scale: Lengths for which the polynomials were computed (K,) [s].
        begin: States at the start (2, 1 + U, K).
        parts: Coefficients of their polynomials over the step (7, 2, 1 + U, K).
    """

    doors: Index
    start: Array
    d_start: Array
    length: Array
    scale: Array
    begin: Array
    parts: Array

    def at(self, time: Array, place: Index) -> Array:
        """Return states (2, 1 + U, M) at times (M,) [s] of the doors at places (M,) or (1,)."""
        x = (time - self.start[place]) / self.scale[place]
        return _value(self.begin[..., place], self.parts[..., place], x)


def _value(begin: Array, parts: Array, x: Array) -> Array:
    """Evaluate the polynomials (7, ..., K) of steps at shares (K,) of their lengths."""
    value: Array | float = 0.0
    rest = 1.0 - x
    for number, part in enumerate(parts[::-1]):
        value = (value + part) * (rest if number % 2 else x)
    return np.asarray(begin + value)


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
        d_end_time: Derivatives of `end_time` by `UNKNOWNS` (U, K); (0, K) if not wanted.
        d_end_angle: Derivatives of `end_angle` by `UNKNOWNS` (U, K); (0, K) if not wanted.
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
                (times[:, None] >= step.start) & (times[:, None] < step.start + step.length))
            if sample.size:
                found = step.at(times[sample], place)[:, 0]
                theta[sample, step.doors[place]], omega[sample, step.doors[place]] = found
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
        for step in self.steps:
            place = np.flatnonzero(step.doors == door)
            if not place.size:
                continue
            start = float(step.start[place[0]])
            span = slice(*np.searchsorted(times, [start, start + step.length[place[0]]]))
            if span.start < span.stop:
                (theta[span], *by), (omega, *_) = step.at(times[span], place)
                slopes[span] = np.transpose(by) - np.outer(omega, step.d_start[:, place])
        return theta, slopes


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
    torque: Callable[[float], float] | None = None,
) -> FreeMotion:
    """Follow motions from their starts.

    Args:
        link: Numbers of the linkages in the order of `closer.four_bar`, (6,) or (6, K).
        ratios: Parameters of the doors over I_A.
        theta0: Angles at the start, a number or (K,) [rad].
        omega0: Angular velocities at the start, a number or (K,) [rad/s].
        until: Times until which the motions are followed, a number or (K,) [s].
        shut_at: Angle at which a closing door is shut and stays shut, a number or (K,) [rad].
        to_peak: Whether a motion is followed only until the door first turns round from opening.
        exact: Whether the derivatives are worked out, too.
        torque: External torque over I_A by time [1/s^2]; None for free motions. A motion ends where
            friction holds the door, even if the torque would move it later.

    Raises:
        DoorModelError: A motion cannot be followed, because a parameter is not a number or huge.
    """
    return _Follower(link, ratios, theta0, omega0, until, shut_at, exact, torque).run(to_peak)


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
        torque: Callable[[float], float] | None,
    ) -> None:
        theta0, omega0 = np.broadcast_arrays(np.atleast_1d(theta0), np.atleast_1d(omega0))
        count = len(theta0)
        link = np.asarray(link, dtype=float)
        self.link = np.broadcast_to(link.reshape(len(link), -1), (len(link), count))
        low, high = angle_limits(*self.link[:5])
        self.low, self.high = low + LIMIT_MARGIN, high - LIMIT_MARGIN
        self.table = ratios.table(count)
        self.until = np.broadcast_to(np.asarray(until, dtype=float), count)
        self.shut_at = np.broadcast_to(np.asarray(shut_at, dtype=float), count)
        self.time = np.zeros(count)
        self.length = np.full(count, _FIRST_STEP)
        self.state = np.zeros((2, 1 + (len(UNKNOWNS) if exact else 0), count))
        self.state[:, 0] = theta0, omega0
        self.d_time = np.zeros((self.state.shape[1] - 1, count))
        if exact:
            self.state[0, 1 + _THETA0] = self.state[1, 1 + _OMEGA0] = 1.0
        self.direction = np.sign(self.state[1, 0])
        self.zone = np.zeros(count, dtype=bool)  # in backcheck (opening) or latch (closing)
        self.end = np.full(count, -1)
        self.peak_time, self.peak_angle = np.full(count, np.nan), np.full(count, np.nan)
        self.steps: list[_Step] = []
        self.torque = torque
        self.longest = _LONGEST_STEP if torque is None else _LONGEST_DRIVEN_STEP

    def run(self, to_peak: bool) -> FreeMotion:
        """Step until every motion has ended."""
        every = np.arange(len(self.time))
        self._set_off(every[self.direction == 0.0])
        self._enter(every)
        while True:
            self.end[(self.end < 0) & (self.time >= self.until - _SHORTEST_STEP)] = End.TIME
            if to_peak:
                self.end[(self.end < 0) & ~np.isnan(self.peak_time)] = End.TIME
            doors = np.flatnonzero(self.end < 0)
            if not doors.size:
                break
            self._advance(doors)
        return FreeMotion(
            self.peak_time, self.peak_angle, self.time, self.state[0, 0], self.state[1, 0],
            self.end, self.steps, self.d_time, self.state[0, 1:])

    def _law(self, doors: Index) -> _Law:
        """Return the law of doors in their present direction and zone."""
        direction, zone = self.direction[doors], self.zone[doors]
        regime = np.where(
            direction > 0.0, np.where(zone, _BACKCHECK, _OPENING),
            np.where(zone, _LATCH, _CLOSING))
        return _Law(self.link[:, doors], self.low[doors], self.high[doors], self.table[:, doors],
                    direction, regime, self.table[regime, doors], self.torque)

    def _set_off(self, doors: Index) -> None:
        """Set the direction in which doors at rest are pulled, unless friction holds them."""
        friction = self.table[_FRICTION, doors]
        rest = self.state[:, :1, doors] * [[[1.0]], [[0.0]]]
        pull = self._law(doors).slopes(rest, self.time[doors])[1, 0]
        pull += self.direction[doors] * friction
        self.direction[doors] = np.sign(pull)
        self.end[doors[np.abs(pull) <= friction]] = End.STUCK

    def _enter(self, doors: Index) -> None:
        """Find out whether doors that begin to move in a direction are in a zone."""
        opens = self.direction[doors] > 0.0
        theta, table = self.state[0, 0, doors], self.table[:, doors]
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
        """Try a step of some doors, which ends early at an event."""
        law, state = self._law(doors), self.state[:, :, doors]
        slopes = law.slopes(state, self.time[doors])
        theta = state[0, 0]
        # Towards the linkage's ends eta grows as 1 / sqrt(distance), so no step may come too close.
        travel = _SHARE_OF_SPACE * np.maximum(
            np.minimum(theta - law.low, law.high - theta), _LEAST_SPACE)
        speed = np.maximum(np.abs(state[1, 0]), np.sqrt(2.0 * np.abs(slopes[1, 0]) * travel))
        length = np.minimum(self.length[doors], travel / np.maximum(speed, 1e-9))
        length = np.minimum(length, self.until[doors] - self.time[doors])
        after, parts, error = _try_step(law, state, self.time[doors], slopes, length)
        good = error <= 1.0
        factor = 0.9 / np.maximum(np.where(np.isfinite(error), error, np.inf), 1e-12) ** 0.125
        length_next = length * np.clip(factor, 0.2, 5.0)
        if not (length_next > _SHORTEST_STEP).all():
            raise DoorModelError(
                "the motion cannot be followed: a parameter is not a number, or is huge",
                quantity="length of a step [s]", value=float(length_next.min()),
                limit=_SHORTEST_STEP)
        self.length[doors] = np.minimum(length_next, self.longest)
        if good.any():
            self._accept(doors[good], length[good], state[..., good], after[..., good],
                         parts[..., good])

    def _accept(
        self, doors: Index, scale: Array, begin: Array, after: Array, parts: Array
    ) -> None:
        """Go to the end of a step, or to its first event, and change direction or zone there."""
        border, ends = self._border(doors)
        sign = self.direction[doors]
        turns = sign * after[1, 0] <= 0.0
        share = np.ones(len(doors))
        share[turns] = _zero(begin[1, 0, turns], parts[:, 1, 0, turns], share[turns])
        turned = np.where(turns, _value(begin[0, 0], parts[:, 0, 0], share), after[0, 0])
        crosses = sign * (turned - border) >= 0.0
        turns &= ~(sign * (turned - border) > 0.0)
        crosses &= ~turns
        share[crosses] = _zero(
            (begin[0, 0] - border)[crosses], parts[:, 0, 0, crosses], share[crosses])
        early = turns | crosses
        after[..., early] = _value(begin[..., early], parts[..., early], share[early])
        length = share * scale
        self.steps.append(_Step(
            doors, self.time[doors], self.d_time[:, doors], length, scale, begin, parts))
        if self.d_time.size:
            self._delay(doors, after, turns, crosses, crosses & ~ends)
        after[1, 0, turns] = 0.0
        after[0, 0, crosses] = border[crosses]
        self.state[:, :, doors] = after
        self.time[doors] += length
        peaks = doors[turns & (sign > 0.0) & np.isnan(self.peak_time[doors])]
        self.peak_time[peaks], self.peak_angle[peaks] = self.time[peaks], self.state[0, 0, peaks]
        self.zone[doors[crosses]] = True
        shut = (sign < 0.0) & (border == self.shut_at[doors])
        self.end[doors[crosses & ends & shut]] = End.SHUT
        self.end[doors[crosses & ends & ~shut]] = End.LINKAGE
        if turns.any():
            self._set_off(doors[turns])
            self._enter(doors[turns])
            self.end[doors[turns & (begin[1, 0] == 0.0) & (length < _INSTANT)]] = End.STUCK

    def _delay(
        self, doors: Index, after: Array, turns: Mask, crosses: Mask, inner: Mask
    ) -> None:
        """Update the derivatives (in place) at the end of a step, whose time has some, too."""
        slopes = self._law(doors).slopes(after, self.time[doors])[:, 0]
        away = after[0, 1:].copy()  # derivative of the distance from the border
        zone = np.where(self.direction[doors] > 0.0, _BACKCHECK_ANGLE, _LATCH_ANGLE)
        away[zone[inner], inner] -= 1.0
        delay = np.zeros_like(away)
        delay[:, turns] = -after[1, 1:, turns].T / slopes[1, turns]
        delay[:, crosses] = -away[:, crosses] / slopes[0, crosses]
        self.d_time[:, doors] += delay
        after[:, 1:] += slopes[:, None] * delay


def _try_step(
    law: _Law, state: Array, time: Array, slopes: Array, length: Array
) -> tuple[Array, Array, Array]:
    """Take a step of `DOP853`.

    Args:
        law: Law of the doors.
        state: States at the start (2, 1 + U, K).
        time: Times at the start (K,) [s].
        slopes: Their derivatives by time.
        length: Lengths of the step (K,) [s].

    Returns:
        States at the end (2, 1 + U, K), coefficients of the polynomials between (7, 2, 1 + U, K),
        and the errors of angle and velocity as shares of the tolerance (K,).
    """
    stages = np.empty((len(_TABLEAU) + 1, *state.shape))
    stages[0] = slopes
    for number, (share, row) in enumerate(zip(_SHARES, _TABLEAU, strict=True), start=1):
        reached = state + length * _weighted(row[:number], stages[:number])
        stages[number] = law.slopes(reached, time + share * length)
        if number == _STAGES - 1:
            after = reached
    scale = _TOLERANCE * (1.0 + np.maximum(np.abs(state[:, 0]), np.abs(after[:, 0])))
    fifth, third = (
        np.square(_weighted(weights, stages[:_STAGES])[:, 0] / scale).max(axis=0)
        for weights in (DOP853.E5, DOP853.E3))
    error = length * fifth / np.sqrt(np.maximum(fifth + 0.01 * third, 1e-300))
    way = after - state
    parts = np.concatenate([
        [way, length * slopes - way, 2.0 * way - length * (stages[_STAGES - 1] + slopes)],
        length * np.tensordot(DOP853.D, stages, 1)])
    return after, parts, error


def _weighted(weights: Array, stages: Array) -> Array:
    """Return the weighted sum of stages; `np.tensordot` takes five times as long for few doors."""
    return np.asarray(weights @ stages.reshape(len(stages), -1)).reshape(stages.shape[1:])


def _zero(begin: Array, parts: Array, share: Array) -> Array:
    """Find where polynomials (7, K) of steps pass 0 before shares (K,) of their lengths."""
    low, high = np.zeros_like(share), share
    if not share.size:
        return high
    sign = np.sign(_value(begin, parts, high))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        beyond = sign * _value(begin, parts, middle) > 0.0
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return high
