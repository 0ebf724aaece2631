"""Motion of a swing door with a closer: eq. (1) and section II.C.2 of the paper."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from door_model.checks import require_finite, require_not_negative, require_positive
from door_model.door import Door
from door_model.driven_motion import DrivenMotion, Swing, end_of_linkage
from door_model.errors import (
    DoorParameterError,
    UnreachableAngleError,
)
from door_model.free_motion import End, FreeMotion, Ratios, follow

_LONGEST_SWING = 60.0  # [s]; a door that has not turned round by then never will


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
    motion = DrivenMotion(door, torque, stop, times)
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
        raise end_of_linkage(
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
