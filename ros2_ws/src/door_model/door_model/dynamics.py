"""Motion of a swing door with a closer: eq. (1) and section II.C.2 of the paper."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from door_model.checks import require_finite, require_not_negative, require_positive
from door_model.closer import FourBarCloser
from door_model.door import Door
from door_model.errors import (
    DoorModelError,
    DoorParameterError,
    LinkageError,
    UnreachableAngleError,
)
from door_model.free_motion import LIMIT_MARGIN, End, FreeMotion, Ratios, follow

_RTOL = 1e-10
_ATOL = 1e-12
_LONGEST_SWING = 60.0  # [s]; a door that has not turned round by then never will


@dataclass(frozen=True)
class Swing:
    """A simulated motion of a door.

    Attributes:
        t: Times (N,) [s].
        theta: Opening angles (N,) [rad].
        omega: Angular velocities (N,) [rad/s].
    """

    t: NDArray[np.float64]
    theta: NDArray[np.float64]
    omega: NDArray[np.float64]


@dataclass(frozen=True)
class Peak:
    """Where a free door turns round.

    Attributes:
        time: From the start [s].
        angle: Opening angle [rad].
    """

    time: float
    angle: float


def simulate(
    door: Door,
    theta0: float,
    omega0: float,
    duration: float,
    *,
    period: float = 1e-3,
    torque: Callable[[float], float] | None = None,
    stop: bool = False,
) -> Swing:
    """Motion of a door by eq. (1).

    Args:
        door: The door.
        theta0: Angle at the start [rad].
        omega0: Angular velocity at the start [rad/s].
        duration: How long [s].
        period: Time between two samples of the answer [s].
        torque: External torque about the hinge over time [N m]; None for a free door.
        stop: End the motion where the door falls shut on its frame (theta = 0); the last sample
            is then the closing one, at its own time.

    Raises:
        DoorParameterError: A number is not finite, duration or period is not positive.
        LinkageError: The motion leaves the angles at which the linkage closes.
    """
    for name, value in (("theta0", theta0), ("omega0", omega0)):
        require_finite(name, value)
    require_positive("duration", duration)
    require_positive("period", period)
    door.closer.f(theta0)  # a LinkageError that names the start
    times = np.arange(math.floor(duration / period + 1e-9) + 1) * period
    times = np.minimum(times, duration)  # the last may pass it by a rounding error
    motion = _Motion(door, torque if torque is not None else _no_torque, stop, times)
    return motion.run(theta0, omega0, duration)


def follow_free(
    doors: Door | Sequence[Door],
    theta0: ArrayLike,
    omega0: ArrayLike,
    *,
    until: float = _LONGEST_SWING,
    to_peak: bool = False,
    stop: bool = True,
) -> FreeMotion:
    """Free motions of one door from many starts, or of many doors: quick and to rounding errors.

    For very many doors give `free_motion.follow` the arrays themselves.

    Args:
        doors: A door, or one for each start.
        theta0: Angles at the start, a number or (K,) [rad].
        omega0: Angular velocities there, a number or (K,) [rad/s].
        until: How long to follow them [s].
        to_peak: Follow each only until it first turns round from opening.
        stop: End a motion where the door falls shut on its frame.

    Raises:
        DoorParameterError: A number is not finite, or there are not as many doors as starts.
        LinkageError: A motion leaves the angles at which its linkage closes.
    """
    every = [doors] if isinstance(doors, Door) else list(doors)
    theta0, omega0 = np.broadcast_arrays(np.atleast_1d(theta0), np.atleast_1d(omega0))
    for name, values in (("theta0", theta0), ("omega0", omega0)):
        if not np.isfinite(values).all():
            raise DoorParameterError(name, values[~np.isfinite(values)][0], "a finite number")
    if len(every) > 1 and len(theta0) == 1:
        theta0, omega0 = (np.repeat(values, len(every)) for values in (theta0, omega0))
    if len(every) not in (1, len(theta0)):
        raise DoorParameterError("number of doors", len(every), f"1 or {len(theta0)}")
    for door, theta in zip(every * (len(theta0) // len(every)), theta0, strict=True):
        door.closer.f(theta)  # a LinkageError that names the start
    link = np.array([door.closer.numbers() for door in every]).T
    rows = [door.ratios() for door in every]
    ratios = Ratios(
        *([getattr(row, field.name) for row in rows] for field in fields(Ratios))
    ) if len(rows) > 1 else rows[0]
    motion = follow(
        link, ratios, theta0, omega0, until=until, shut_at=0.0 if stop else -np.inf,
        to_peak=to_peak)
    beyond = np.flatnonzero(motion.end == End.LINKAGE)
    if beyond.size:
        first = int(beyond[0])
        closer = every[first if len(every) > 1 else 0].closer
        raise _end_of_linkage(
            float(theta0[first]), float(omega0[first]), float(motion.end_angle[first]), closer)
    return motion


def peak(door: Door, theta0: float, omega0: float) -> Peak:
    """Time and angle at which a freely opening door turns round.

    Args:
        door: The door.
        theta0: Angle at the start [rad].
        omega0: Angular velocity at the start [rad/s], positive.

    Raises:
        DoorParameterError: A number is not finite or omega0 is not positive.
        LinkageError: The door opens further than its linkage allows.
        UnreachableAngleError: The door never turns round.
    """
    require_finite("theta0", theta0)
    require_positive("omega0", omega0)
    motion = follow_free(door, theta0, omega0, to_peak=True)
    if np.isnan(motion.peak_time[0]):
        raise UnreachableAngleError(
            f"the door has not turned round after {_LONGEST_SWING:.0f} s: nothing pulls it back",
            value=omega0,
            limit=_LONGEST_SWING,
        )
    return Peak(time=float(motion.peak_time[0]), angle=float(motion.peak_angle[0]))


def initial_velocity(door: Door, angle: float, theta0: float = 0.0) -> float:
    """Angular velocity w' that opens a free door to an angle, section II.C.2.

    Eq. (1) is integrated backwards in time from rest at the angle until theta0.

    Args:
        door: The door.
        angle: Desired opening angle [rad].
        theta0: Angle of the door just after the hit [rad].

    Returns:
        w' [rad/s].

    Raises:
        DoorParameterError: An angle is not finite, theta0 is negative or not below the angle.
        LinkageError: The angle is beyond the linkage.
        UnreachableAngleError: The door does not turn round there, or turns round before.
    """
    require_finite("angle", angle)
    require_not_negative("theta0", theta0)
    if not angle > theta0:
        raise DoorParameterError("angle", angle, f"above the start angle {theta0} rad")
    pull = float(door.restoring_torque(angle)) + door.friction
    if pull <= 0.0:
        raise UnreachableAngleError(
            f"the closer does not pull the door back at {math.degrees(angle):.2f} deg "
            f"(restoring torque {pull:.3g} N m), so the door does not turn round there",
            value=angle,
            limit=pull,
        )
    motion = follow(
        door.closer.numbers(), _backwards(door), angle, 0.0, until=_LONGEST_SWING, shut_at=theta0)
    if motion.end[0] != End.SHUT:
        raise UnreachableAngleError(
            f"no start at {math.degrees(theta0):.2f} deg leads to rest at "
            f"{math.degrees(angle):.2f} deg: the door would turn round before",
            value=angle,
            limit=theta0,
        )
    return -float(motion.end_speed[0])


def _backwards(door: Door) -> Ratios:
    """Ratios with which a door closes as it opens when time runs backwards.

    With s = -t eq. (1) keeps its form, while damping and friction change their sign.
    """
    ratios = door.ratios()
    beyond = -np.asarray(ratios.backcheck)
    below = -np.asarray(ratios.opening)
    return Ratios(
        opening=beyond, closing=beyond, backcheck=beyond, latch=below, spring=ratios.spring,
        preload=ratios.preload, friction=-np.asarray(ratios.friction),
        latch_angle=ratios.backcheck_angle)


def _end_of_linkage(
    theta0: float, omega0: float, theta: float, closer: FourBarCloser
) -> LinkageError:
    """The error of a motion that comes to the end of the angles at which its linkage closes."""
    lower, upper = closer.closing_limit(), closer.opening_limit()
    opens = theta > 0.5 * (lower + upper)
    limit = upper if opens else lower
    return LinkageError(
        "l2 + l3" if opens else "l2, l3",
        limit,
        f"the motion from {math.degrees(theta0):.2f} deg at {omega0:.3f} rad/s reaches "
        "the end of its range",
        value=theta,
        limit=limit,
    )


def _no_torque(_t: float) -> float:
    """Of a free door."""
    return 0.0


class _Motion:
    """A motion under an external torque, in pieces that keep direction and zone."""

    def __init__(
        self, door: Door, torque: Callable[[float], float], stop: bool, times: NDArray[Any]
    ) -> None:
        self.door, self.torque, self.stop, self.times = door, torque, stop, times
        self.upper = door.closer.opening_limit() - LIMIT_MARGIN
        self.lower = door.closer.closing_limit() + LIMIT_MARGIN
        closing = door.c_c if door.c_c_closing is None else door.c_c_closing
        # A door that resists alike in both directions needs no cut where it turns round.
        self.symmetric = (
            closing == door.c_c and not door.friction and not door.backcheck and not door.latch)

    def run(self, theta0: float, omega0: float, duration: float) -> Swing:
        """From the start to the end, or to where the door falls shut."""
        theta, omega = np.full_like(self.times, theta0), np.full_like(self.times, omega0)
        now, state, shut = 0.0, (theta0, omega0), False
        while now < duration and not shut:
            direction, wait = self._direction(now, state)
            if not direction:
                end = min(duration, now + wait)
                held = self.times >= now
                theta[held], omega[held] = state[0], 0.0
                now = end
                continue
            now, state, shut = self._piece(now, duration, state, direction, theta, omega)
        if not shut:
            return Swing(self.times, theta, omega)
        before = self.times < now
        return Swing(
            np.append(self.times[before], now), np.append(theta[before], state[0]),
            np.append(omega[before], state[1]))

    def _direction(self, now: float, state: tuple[float, float]) -> tuple[float, float]:
        """Sign of the motion; at rest 0 while friction holds the door, and for how long [s]."""
        if state[1] or self.symmetric:
            return math.copysign(1.0, state[1]), 0.0
        pull = float(self.door.restoring_torque(state[0]))

        def freed(t: float) -> float:
            return abs(self.torque(t) - pull) - self.door.friction

        net = self.torque(now) - pull
        if freed(now) > 0.0:
            return math.copysign(1.0, net), 0.0
        for before, after in zip(*self._looks(now), strict=True):
            if freed(after) > 0.0:
                root = brentq(freed, before, after) if freed(before) < 0.0 else after
                # Just behind the root, so that the torque has a sign.
                return 0.0, max(root - now, 1e-9) + 1e-9
        return 0.0, math.inf

    def _looks(self, now: float) -> Iterator[Any]:
        """Times from now on at which to look whether the torque frees the door, in pairs."""
        later = self.times[self.times > now]
        return iter((np.concatenate([[now], later[:-1]]), later))

    def _piece(
        self, now: float, duration: float, state: tuple[float, float], direction: float,
        theta: NDArray[Any], omega: NDArray[Any],
    ) -> tuple[float, tuple[float, float], bool]:
        """Integrate until the law changes; fills the samples, gives time, state, whether shut."""
        door, opens = self.door, direction > 0.0
        zone = door.backcheck if opens else door.latch
        inside = zone is not None and (
            state[0] >= zone.angle if opens else state[0] <= zone.angle)
        c_c = float(door.viscosity(state[0], direction))
        friction = direction * door.friction

        def slope(t: float, x: NDArray[Any]) -> tuple[float, float]:
            # A trial stage of the solver may step outside where the motion itself does not.
            f, eta = door.closer.f_and_eta(min(max(x[0], self.lower), self.upper))
            drag = c_c * eta * x[1] + door.k_c * f + door.tau_c0_prime
            return x[1], float(self.torque(t) - eta * drag - friction) / door.i_a

        events = [_event(lambda x: min(self.upper - x[0], x[0] - self.lower), 0)]
        if self.stop:
            events.append(_event(lambda x: x[0], -1))
        cuts = len(events)
        if not self.symmetric:
            events.append(_event(lambda x: x[1], -direction))
        border = math.inf if zone is None else zone.angle
        if zone is not None and not inside:
            events.append(_event(lambda x: x[0] - border, direction))
        first = int(np.searchsorted(self.times, now))
        solution = solve_ivp(
            slope, (now, duration), state, method="DOP853", rtol=_RTOL, atol=_ATOL, events=events,
            t_eval=self.times[first:])
        if not solution.success:
            raise DoorModelError(f"the integration failed: {solution.message}", value=state[1])
        if solution.t_events[0].size:
            raise _end_of_linkage(*state, float(solution.y_events[0][0][0]), door.closer)
        if len(solution.t):
            span = slice(first, first + len(solution.t))
            theta[span], omega[span] = solution.y
        for number, (at, states) in enumerate(
            zip(solution.t_events, solution.y_events, strict=True)
        ):
            if at.size:
                angle, speed = (float(value) for value in states[0])
                if number >= cuts:  # exactly, or rounding would meet it again
                    turned = not self.symmetric and number == cuts
                    angle, speed = (angle, 0.0) if turned else (border, speed)
                return float(at[0]), (angle, speed), number < cuts
        return duration, state, False


def _event(value: Callable[[NDArray[Any]], float], direction: float) -> Callable[..., float]:
    """Terminal event of `solve_ivp` where a function of the state passes 0."""

    def event(_t: float, state: NDArray[Any]) -> float:
        return float(value(state))

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = direction  # type: ignore[attr-defined]
    return event
