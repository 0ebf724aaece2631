"""Motion of a door under an external torque, which may free it where friction holds it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from door_model.door.closer import FourBarCloser
from door_model.door.door import Door
from door_model.errors import LinkageError
from door_model.motion.free_motion import End, follow

_INSTANT = 1e-9  # time after which a torque that frees the door certainly exceeds its friction [s]


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


def drive(
    door: Door, theta0: float, omega0: float, times: NDArray[np.float64], duration: float, *,
    torque: Callable[[float], float] | None, stop: bool,
) -> SampledMotion:
    """Follow the motion under an external torque from one hold by friction to the next.

    Args:
        door: The door.
        theta0: Angle at the start [rad].
        omega0: Angular velocity at the start [rad/s].
        times: Sample times, increasing from 0, (N,) [s].
        duration: Time at the end [s].
        torque: External torque over time [N m]; None for a free door.
        stop: Whether the motion ends where the door falls shut; the last sample is then there.

    Raises:
        LinkageError: The motion leaves the angles at which the linkage closes.
        DoorModelError: The motion cannot be followed.
    """
    now, state = 0.0, (theta0, omega0)
    theta, omega = np.empty_like(times), np.empty_like(times)
    while now <= duration:
        piece = follow(
            door.closer.numbers(), door.ratios(), *state, until=duration - now + _INSTANT,
            shut_at=0.0 if stop else -np.inf,
            torque=None if torque is None else partial(_ratio, torque, door.i_a, now))
        rest = times >= now
        theta[rest], omega[rest] = (rows[:, 0] for rows in piece.at(times[rest] - now))
        now += float(piece.end_time[0])
        state = float(piece.end_angle[0]), float(piece.end_speed[0])
        if piece.end[0] == End.LINKAGE:
            raise end_of_linkage(theta0, omega0, state[0], door.closer)
        if piece.end[0] == End.SHUT:
            before = times < now
            return SampledMotion(
                np.append(times[before], now), np.append(theta[before], state[0]),
                np.append(omega[before], state[1]))
        if piece.end[0] == End.TIME or torque is None:
            break
        now = _freed(door, state[0], torque, now, times)
    return SampledMotion(times, theta, omega)


def _ratio(torque: Callable[[float], float], i_a: float, begin: float, t: float) -> float:
    return torque(begin + t) / i_a


def _freed(
    door: Door, theta: float, torque: Callable[[float], float], now: float,
    times: NDArray[np.float64],
) -> float:
    """Return the time [s] at which a torque frees a door that friction holds, or infinity.

    A torque that exceeds the friction for less than the time between two samples may not free it.
    """
    pull = float(door.restoring_torque(theta))

    def excess(t: float) -> float:
        return abs(torque(t) - pull) - door.friction

    for before, after in pairwise([now, *times[times > now + _INSTANT].tolist()]):
        if excess(after) > 0.0:
            root = brentq(excess, before, after) if excess(before) < 0.0 else after
            return root + _INSTANT
    return math.inf
