"""Motion of a door under an external torque, in pieces that keep direction and zone."""

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

_RTOL = 1e-10
_ATOL = 1e-12


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


def end_of_linkage(
    theta0: float, omega0: float, theta: float, closer: FourBarCloser, where: str = ""
) -> LinkageError:
    """The error of a motion that comes to the end of the angles at which its linkage closes.

    `where` says which of many it is, see `checks.place`.
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


class DrivenMotion:
    """A motion under an external torque, in pieces that keep direction and zone."""

    def __init__(
        self,
        door: Door,
        torque: Callable[[float], float] | None,
        stop: bool,
        times: NDArray[Any],
    ) -> None:
        self.door, self.stop, self.times = door, stop, times
        self.torque = torque if torque is not None else lambda _: 0.0
        self.upper = door.closer.opening_limit() - LIMIT_MARGIN
        self.lower = door.closer.closing_limit() + LIMIT_MARGIN
        # A door that resists alike in both directions needs no cut where it turns round.
        self.symmetric = (
            door.closing_viscosity == door.c_c
            and not (door.friction or door.backcheck or door.latch)
        )

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
        for before, after in pairwise([now, *self.times[self.times > now]]):
            if freed(after) > 0.0:
                root = brentq(freed, before, after) if freed(before) < 0.0 else after
                # Just behind the root, so that the torque has a sign.
                return 0.0, max(root - now, 1e-9) + 1e-9
        return 0.0, math.inf

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
            raise end_of_linkage(*state, float(solution.y_events[0][0][0]), door.closer)
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
