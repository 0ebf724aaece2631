"""Dynamics of a swing door with a closer: eqs. (1), (12), (13) and section II.C.2 of the paper.

Eq. (12)'s ``tau'_c0`` is ``tau_c0 - k_c theta_c0`` (the paper prints ``theta_0``), so that the
closer's torque is ``k_c f(theta) + tau'_c0``. ``c_c`` is in N m s/rad.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from door_model.checks import (
    require_finite,
    require_not_negative,
    require_positive,
)
from door_model.closer import FourBarCloser
from door_model.errors import (
    DoorModelError,
    DoorParameterError,
    LinkageError,
    UnreachableAngleError,
)

_RTOL = 1e-10
_ATOL = 1e-12
_LONGEST_SWING = 60.0  # [s]; a door that has not turned round by then never will
_LIMIT_MARGIN = 1e-6  # [rad]; eta grows without bound where the linkage is stretched


@dataclass(frozen=True)
class Door:
    """A leaf on a hinge with a closer, eq. (1).

    Attributes:
        i_a: Moment of inertia of the leaf about its hinge [kg m^2] (the paper's text calls it
            an angular momentum).
        c_c: Viscosity at the closer's joint [N m s/rad].
        k_c: Spring coefficient at the closer's joint [N m/rad].
        tau_c0_prime: Closer torque of eq. (12), extrapolated to theta_c = 0 [N m].
        closer: The linkage.

    Raises:
        DoorParameterError: i_a is not positive, c_c or k_c is negative, or one is no number.
    """

    i_a: float
    c_c: float
    k_c: float
    tau_c0_prime: float
    closer: FourBarCloser

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_positive("i_a", self.i_a)
        require_not_negative("c_c", self.c_c)
        require_not_negative("k_c", self.k_c)
        require_finite("tau_c0_prime", self.tau_c0_prime)

    def restoring_torque(self, theta: ArrayLike) -> Any:
        """Torque that shuts the door, eq. (12) [N m], for angle(s) theta [rad]."""
        f, eta = self.closer.f_and_eta(theta)
        return eta * (self.k_c * f + self.tau_c0_prime)

    def damping_torque(self, theta: ArrayLike, omega: ArrayLike) -> Any:
        """Torque against the motion, eq. (13) [N m], at angle(s) [rad] and velocity [rad/s]."""
        return self.c_c * self.closer.eta(theta) ** 2 * np.asarray(omega, dtype=float)

    def acceleration(self, theta: ArrayLike, omega: ArrayLike, tau_ext: ArrayLike = 0.0) -> Any:
        """Angular acceleration by eq. (1) [rad/s^2].

        Args:
            theta: Opening angle(s) [rad].
            omega: Angular velocity [rad/s].
            tau_ext: External torque about the hinge, positive when it opens [N m].

        Raises:
            LinkageError: The linkage does not close at one of the angles.
        """
        f, eta = self.closer.f_and_eta(theta)
        closer_torque = self.c_c * eta * np.asarray(omega, dtype=float) + (
            self.k_c * f + self.tau_c0_prime
        )
        return (np.asarray(tau_ext, dtype=float) - eta * closer_torque) / self.i_a

    def potential_energy(self, theta: ArrayLike) -> Any:
        """Energy in the spring [J]: eq. (12) integrated, since eta is the slope of f.

        Its zero is theta_c = 0; only differences mean anything.
        """
        f = self.closer.f(theta)
        return 0.5 * self.k_c * f**2 + self.tau_c0_prime * f

    def energy(self, theta: ArrayLike, omega: ArrayLike) -> Any:
        """Kinetic and spring energy [J]."""
        kinetic = 0.5 * self.i_a * np.asarray(omega, dtype=float) ** 2
        return kinetic + self.potential_energy(theta)


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
    events = [_crossing(0.0, -1)] if stop else []
    times = np.arange(math.floor(duration / period + 1e-9) + 1) * period
    times = np.minimum(times, duration)  # the last may pass it by a rounding error
    solution = _solve(door, theta0, omega0, duration, events, times=times, torque=torque)
    t, state = solution.t, solution.y
    if stop and solution.t_events[-1].size:
        t = np.append(t, solution.t_events[-1][0])
        state = np.column_stack([state, solution.y_events[-1][0]])
    return Swing(t=t, theta=state[0], omega=state[1])


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
    solution = _solve(door, theta0, omega0, _LONGEST_SWING, [_standstill(-1)])
    if not solution.t_events[-1].size:
        raise UnreachableAngleError(
            f"the door has not turned round after {_LONGEST_SWING:.0f} s: nothing pulls it back",
            value=omega0,
            limit=_LONGEST_SWING,
        )
    return Peak(time=float(solution.t_events[-1][0]), angle=float(solution.y_events[-1][0][0]))


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
    pull = float(door.restoring_torque(angle))
    if pull <= 0.0:
        raise UnreachableAngleError(
            f"the closer does not pull the door back at {math.degrees(angle):.2f} deg "
            f"(restoring torque {pull:.3g} N m), so the door does not turn round there",
            value=angle,
            limit=pull,
        )
    events = [_crossing(theta0, -1), _standstill(-1)]
    solution = _solve(door, angle, 0.0, _LONGEST_SWING, events, backwards=True)
    if not solution.t_events[1].size:
        raise UnreachableAngleError(
            f"no start at {math.degrees(theta0):.2f} deg leads to rest at "
            f"{math.degrees(angle):.2f} deg: the door would turn round before",
            value=angle,
            limit=theta0,
        )
    return float(solution.y_events[1][0][1])


def _crossing(angle: float, direction: int) -> Callable[..., float]:
    """Terminal event: the angle is passed."""

    def event(_t: float, state: NDArray[Any]) -> float:
        return float(state[0] - angle)

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = direction  # type: ignore[attr-defined]
    return event


def _standstill(direction: int) -> Callable[..., float]:
    """Terminal event: the velocity changes its sign."""

    def event(_t: float, state: NDArray[Any]) -> float:
        return float(state[1])

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = direction  # type: ignore[attr-defined]
    return event


def _solve(
    door: Door,
    theta0: float,
    omega0: float,
    duration: float,
    events: list[Callable[..., float]],
    *,
    times: NDArray[Any] | None = None,
    torque: Callable[[float], float] | None = None,
    backwards: bool = False,
) -> Any:
    """Integrate eq. (1); the first event of the answer is always the linkage's end.

    Backwards, time runs to -t while the sign of the velocity is kept: with s = -t,
    d theta/ds = -omega and d omega/ds = -acceleration.
    """
    door.closer.f(theta0)  # a LinkageError that names the start, before the solver sees it
    upper = door.closer.opening_limit() - _LIMIT_MARGIN
    lower = door.closer.closing_limit() + _LIMIT_MARGIN
    sign = -1.0 if backwards else 1.0

    def slope(t: float, state: NDArray[Any]) -> tuple[float, float]:
        # A trial stage of the solver may step outside where the motion itself does not.
        theta = min(max(state[0], lower), upper)
        push = 0.0 if torque is None else torque(t)
        return sign * state[1], sign * float(door.acceleration(theta, state[1], push))

    def linkage_end(_t: float, state: NDArray[Any]) -> float:
        return float(min(upper - state[0], state[0] - lower))

    linkage_end.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        slope,
        (0.0, duration),
        (theta0, omega0),
        method="DOP853",
        rtol=_RTOL,
        atol=_ATOL,
        events=[linkage_end, *events],
        t_eval=times,
    )
    if solution.t_events[0].size:
        theta = float(solution.y_events[0][0][0])
        limit = upper if theta > 0.5 * (upper + lower) else lower
        raise LinkageError(
            "l2 + l3" if limit == upper else "l2, l3",
            theta,
            f"the motion from {math.degrees(theta0):.2f} deg at {omega0:.3f} rad/s reaches "
            "the end of its range",
            value=theta,
            limit=limit,
        )
    if not solution.success:
        raise DoorModelError(f"the integration failed: {solution.message}", value=omega0)
    return solution
