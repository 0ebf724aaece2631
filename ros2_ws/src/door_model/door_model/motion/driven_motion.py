"""Motion of a door under an external torque, integrated in pieces with one direction and zone."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from door_model.door.closer import LIMIT_MARGIN, FourBarCloser
from door_model.door.door import Door
from door_model.errors import DoorModelError, LinkageError

_INSTANT = 1e-9  # shortest time for which friction frees the door [s]
_RTOL = 1e-10  # relative tolerance of the solver
_ATOL = 1e-12  # absolute tolerance of the solver [rad], [rad/s]


@dataclass(frozen=True)
class SampledMotion:
    """A simulated motion of a door, as samples.

    Attributes:
        t: Sample times, increasing, (N,) [s].
        theta: Opening angles (N,) [rad].
        omega: Angular velocities (N,) [rad/s].
    """

    t: NDArray[np.float64]
    theta: NDArray[np.float64]
    omega: NDArray[np.float64]


def end_of_linkage(
    theta0: float, omega0: float, theta: float, closer: FourBarCloser, where: str = ""
) -> LinkageError:
    """Return the error for a motion that reaches an angle at which its linkage does not close.

    Args:
        theta0: Angle at the start [rad].
        omega0: Angular velocity at the start [rad/s].
        theta: Angle at which the motion ends [rad].
        closer: The linkage.
        where: Element of an array to which the motion belongs, as `checks.place` returns it.
    """
    lower, upper = closer.closing_limit(), closer.opening_limit()
    opens = theta > 0.5 * (lower + upper)
    limit = upper if opens else lower
    return LinkageError(
        closer.end_link(opens),
        limit,
        f"the motion from {math.degrees(theta0):.2f} deg at {omega0:.3f} rad/s reaches "
        f"the end of its range, set by {closer.end_link(opens)}{where}",
        value=theta,
        limit=limit,
    )


class DrivenIntegrator:
    """Integrates a motion under an external torque, in pieces with one direction and zone.

    Within such a piece eq. (1) is smooth, as the solver requires.
    """

    def __init__(
        self,
        door: Door,
        torque: Callable[[float], float] | None,
        stop: bool,
        times: NDArray[Any],
    ) -> None:
        """Set the problem.

        Args:
            door: The door.
            torque: External torque over time [N m]; None for a free door.
            stop: Whether the motion ends where the door falls shut.
            times: Sample times, increasing from 0, (N,) [s].
        """
        self.door, self.stop, self.times = door, stop, times
        self.torque = torque if torque is not None else lambda _: 0.0
        self.upper = door.closer.opening_limit() - LIMIT_MARGIN
        self.lower = door.closer.closing_limit() + LIMIT_MARGIN
        # If the door resists equally in both directions, no cut is needed where it turns round.
        self.symmetric = (
            door.closing_viscosity == door.c_c
            and not (door.friction or door.backcheck or door.latch)
        )

    def run(self, theta0: float, omega0: float, duration: float) -> SampledMotion:
        """Integrate from a start to the end, or to the time at which the door falls shut.

        Args:
            theta0: Angle at the start [rad].
            omega0: Angular velocity at the start [rad/s].
            duration: Time to integrate [s].

        Raises:
            LinkageError: The motion leaves the angles at which the linkage closes.
            DoorModelError: The solver fails.
        """
        theta, omega = np.full_like(self.times, theta0), np.full_like(self.times, omega0)
        now, state, shut = 0.0, (theta0, omega0), False
        while now < duration and not shut:
            direction, wait = self._direction(now, state)
            if direction:
                begin = now
                now, state, shut = self._piece(begin, duration, state, direction, theta, omega)
                if now - begin >= _INSTANT or state[1] or shut:
                    continue
                # The torque exceeds the friction by its rounding alone, and falls below it again:
                # friction holds the door, at least to the next sample.
                later = self.times[self.times > now + _INSTANT]
                wait = later[0] - now if later.size else math.inf
            held = self.times >= now
            theta[held], omega[held] = state[0], 0.0
            now = min(duration, now + wait)
        if not shut:
            return SampledMotion(self.times, theta, omega)
        before = self.times < now
        return SampledMotion(
            np.append(self.times[before], now), np.append(theta[before], state[0]),
            np.append(omega[before], state[1]))

    def _direction(self, now: float, state: tuple[float, float]) -> tuple[float, float]:
        """Return the sign of the motion, or 0 and a time [s] if friction holds the door so long."""
        if state[1] or self.symmetric:
            return math.copysign(1.0, state[1]), 0.0
        pull = float(self.door.restoring_torque(state[0]))

        def freed(t: float) -> float:
            return abs(self.torque(t) - pull) - self.door.friction

        net = self.torque(now) - pull
        if freed(now) > 0.0:
            return math.copysign(1.0, net), 0.0
        for before, after in pairwise([now, *self.times[self.times > now]]):
            if freed(after) > 0.0:
                root = brentq(freed, before, after) if freed(before) < 0.0 else after
                # A little after the root, so that the sign of the torque is certain.
                return 0.0, max(root - now, 1e-9) + 1e-9
        return 0.0, math.inf

    def _piece(
        self, now: float, duration: float, state: tuple[float, float], direction: float,
        theta: NDArray[Any], omega: NDArray[Any],
    ) -> tuple[float, tuple[float, float], bool]:
        """Integrate until direction or zone changes, and write the samples on the way.

        Returns:
            Time [s] and state [rad], [rad/s] at the end, and whether the door has fallen shut.
        """
        door, opens = self.door, direction > 0.0
        zone = door.backcheck if opens else door.latch
        inside = zone is not None and (
            state[0] >= zone.angle if opens else state[0] <= zone.angle)
        c_c = float(door.viscosity(state[0], direction))
        friction = direction * door.friction

        def slope(t: float, x: NDArray[Any]) -> tuple[float, float]:
            # A trial stage of the solver may leave the linkage's range though the motion does not.
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
            raise DoorModelError(
                f"the integration failed: {solution.message}",
                quantity="angular velocity [rad/s]", value=state[1], limit="a motion that the "
                "solver can follow")
        if solution.t_events[0].size:
            raise end_of_linkage(*state, float(solution.y_events[0][0][0]), door.closer)
        if len(solution.t):
            span = slice(first, first + len(solution.t))
            theta[span], omega[span] = solution.y
        for number, (at, states) in enumerate(
            zip(solution.t_events, solution.y_events, strict=True)
        ):
            if at.size:
                angle, speed = (float(value) for value in states[0])
                if number >= cuts:  # set exactly, or rounding would trigger the event again
                    turned = not self.symmetric and number == cuts
                    angle, speed = (angle, 0.0) if turned else (border, speed)
                return float(at[0]), (angle, speed), number < cuts
        return duration, state, False


def _event(value: Callable[[NDArray[Any]], float], direction: float) -> Callable[..., float]:
    """Return a terminal event for `solve_ivp` at which a function of the state passes 0."""

    def event(_t: float, state: NDArray[Any]) -> float:
        return float(value(state))

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = direction  # type: ignore[attr-defined]
    return event
