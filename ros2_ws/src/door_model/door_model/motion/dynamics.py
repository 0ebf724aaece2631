"""Motion of a swing door with a closer: eq. (1) and section II.C.2 of the paper."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from door_model.checks import place, require_each, require_finite, require_positive
from door_model.door.door import Door
from door_model.door.ratios import Ratios
from door_model.errors import (
    DeadCentreError,
    DoorModelError,
    DoorParameterError,
    UnreachableAngleError,
)
from door_model.motion.driven_motion import DrivenIntegrator, SampledMotion, end_of_linkage
from door_model.motion.free_motion import End, FreeMotion, follow

_AT_REST = 1e-12  # speed of a door at rest, whose sign is the direction of motion [rad/s]
_LONGEST_SWING = 60.0  # a door that has not turned round after this time never will [s]


@dataclass(frozen=True)
class Peak:
    """Where a free door turns round: numbers for one start, arrays of the starts' shape for many.

    Attributes:
        time: Time from the start to the peak [s].
        angle: Opening angle at the peak [rad].
    """

    time: Any
    angle: Any


def simulate(
    door: Door,
    theta0: float,
    omega0: float,
    duration: float,
    *,
    period: float = 1e-3,
    torque: Callable[[float], float] | None = None,
    stop: bool = False,
) -> SampledMotion:
    """Simulate the motion of a door by eq. (1).

    Args:
        door: The door.
        theta0: Angle at the start [rad].
        omega0: Angular velocity at the start [rad/s].
        duration: Time to simulate [s].
        period: Time between two samples of the result [s].
        torque: External torque about the hinge over time [N m]; None for a free door.
        stop: Whether the motion ends when the door falls shut on its frame (theta = 0); the last
            sample is then at the time of closing.

    Raises:
        DoorParameterError: A number is not finite, or duration or period is not positive.
        LinkageError: The motion leaves the angles at which the linkage closes.
    """
    for name, value in (("theta0", theta0), ("omega0", omega0)):
        require_finite(name, value)
    require_positive("duration", duration)
    require_positive("period", period)
    door.closer.require_within(theta0)  # raises the error that names the start
    times = np.arange(math.floor(duration / period + 1e-9) + 1) * period
    times = np.minimum(times, duration)  # rounding may put the last one after it
    motion = DrivenIntegrator(door, torque, stop, times)
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
    """Follow free motions of one door from many starts, or of many doors, to rounding errors.

    For very many doors call `free_motion.follow` with arrays, which is faster.

    Args:
        doors: One door, or a door for each start.
        theta0: Angles at the start, a number or (K,) [rad].
        omega0: Angular velocities at the start, a number or (K,) [rad/s].
        until: Time for which the motions are followed [s].
        to_peak: Whether a motion is followed only until the door first turns round from
            opening.
        stop: Whether a motion ends when the door falls shut on its frame.

    Raises:
        DoorParameterError: A number is not finite, or the numbers of doors and starts differ.
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
    starts = theta0 if len(every) == len(theta0) else [theta0]
    for door, start in zip(every, starts, strict=True):
        door.closer.require_within(start)  # raises the error that names the start
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


def peak(door: Door, theta0: ArrayLike, omega0: ArrayLike) -> Peak:
    """Return time and angle at which a freely opening door turns round.

    Args:
        door: The door.
        theta0: Angle(s) at the start [rad].
        omega0: Angular velocity or velocities at the start [rad/s], positive; any shape that
            broadcasts with theta0.

    Raises:
        DoorParameterError: A number is not finite or omega0 is not positive.
        LinkageError: The door opens further than its linkage allows.
        DeadCentreError: The door passes a dead centre and its spring throws it open.
        UnreachableAngleError: The door never turns round.
            Errors about an array name the element.
    """
    theta0, omega0 = _broadcast(theta0, omega0)
    require_each("theta0", theta0, np.isfinite(theta0), "a finite number")
    require_each(
        "omega0", omega0, np.isfinite(omega0) & (omega0 > 0.0), "a positive finite number")
    door.closer.require_within(theta0)  # raises the error that names the start
    motion = follow(
        door.closer.numbers(), door.ratios(), theta0.ravel(), omega0.ravel(),
        until=_LONGEST_SWING, to_peak=True)
    for first in np.flatnonzero(np.isnan(motion.peak_time)).tolist():
        raise _no_peak(door, motion, theta0, omega0, first)
    shape = theta0.shape
    return Peak(_shaped(motion.peak_time, shape), _shaped(motion.peak_angle, shape))


def initial_velocity(door: Door, angle: ArrayLike, theta0: ArrayLike = 0.0) -> Any:
    """Return the angular velocity w' that opens a free door to an angle, section II.C.2.

    Eq. (1) is integrated backwards in time, from rest at the angle to theta0. Friction may hold the
    door at an angle beyond a dead centre; then w' exists for this angle, too.

    Args:
        door: The door.
        angle: Desired opening angle(s) [rad].
        theta0: Angle(s) of the door just after the hit [rad]; any shape that broadcasts with angle.

    Returns:
        w' [rad/s]: a number if both arguments are numbers, else an array.

    Raises:
        DoorParameterError: An angle is not finite, theta0 is negative or not below the angle.
        LinkageError: The angle is beyond the linkage.
        DeadCentreError: The angle is beyond a dead centre, and the door does not come to rest
            there.
        UnreachableAngleError: The door does not turn round at the angle, or turns round before.
            Errors about an array name the element.
    """
    angle, theta0 = _broadcast(angle, theta0)
    shape = angle.shape
    require_each("angle", angle, np.isfinite(angle), "a finite number")
    require_each("theta0", theta0, np.isfinite(theta0) & (theta0 >= 0.0),
                 "a finite number of 0 or above")
    for first in np.flatnonzero(angle <= theta0).tolist():
        raise DoorParameterError(
            f"angle{place(shape, first)}", float(angle.flat[first]),
            f"above the start angle {theta0.flat[first]} rad")
    door.closer.require_within(angle)
    pull = np.asarray(door.restoring_torque(angle))
    for first in np.flatnonzero(pull + door.friction <= 0.0).tolist():
        raise _no_rest(
            door, angle, first, float(pull.flat[first]),
            f"the closer does not pull the door back at {math.degrees(angle.flat[first]):.2f} deg "
            f"(restoring torque {pull.flat[first]:.3g} N m), so the door does not turn round there")
    motion = follow(
        door.closer.numbers(), _backwards(door), angle.ravel(), -_AT_REST, until=_LONGEST_SWING,
        shut_at=theta0.ravel())
    for first in np.flatnonzero(motion.end != End.SHUT).tolist():
        start = float(theta0.flat[first])
        raise _no_rest(
            door, angle, first, start,
            f"no start at {math.degrees(start):.2f} deg leads to rest at "
            f"{math.degrees(angle.flat[first]):.2f} deg: the door would turn round before")
    return _shaped(-motion.end_speed, shape)


def _broadcast(*numbers: ArrayLike) -> list[NDArray[np.float64]]:
    """Convert numbers or arrays to arrays of one shape."""
    return list(np.broadcast_arrays(*(np.asarray(number, dtype=float) for number in numbers)))


def _shaped(values: NDArray[np.float64], shape: tuple[int, ...]) -> Any:
    """Bring results (K,) into the shape of the arguments: a float for numbers."""
    return values.reshape(shape) if shape else float(values[0])


def _no_rest(
    door: Door, angle: NDArray[np.float64], number: int, limit: float, reason: str
) -> UnreachableAngleError:
    """Return the error for an angle at which a door does not come to rest."""
    value, reason = float(angle.flat[number]), reason + place(angle.shape, number)
    dead_centre = door.dead_centre()
    if dead_centre is not None and value >= dead_centre:
        return DeadCentreError(dead_centre, reason, value=value)
    return UnreachableAngleError(
        reason, quantity="opening angle [rad]", value=value, limit=limit)


def _no_peak(
    door: Door, motion: FreeMotion, theta0: NDArray[np.float64], omega0: NDArray[np.float64],
    number: int,
) -> DoorModelError:
    """Return the error for a door that does not turn round."""
    start, speed, where = theta0.flat[number], omega0.flat[number], place(theta0.shape, number)
    end, dead_centre = float(motion.end_angle[number]), door.dead_centre()
    if dead_centre is not None and end >= dead_centre:
        return DeadCentreError(
            dead_centre,
            f"from {math.degrees(start):.2f} deg at {speed:.3f} rad/s it does not turn round, but "
            f"opens to {math.degrees(end):.2f} deg{where}",
            value=end,
        )
    if motion.end[number] == End.LINKAGE:
        return end_of_linkage(start, speed, end, door.closer, where)
    return UnreachableAngleError(
        f"the door has not turned round after {_LONGEST_SWING:.0f} s: nothing pulls it "
        f"back{where}",
        quantity="time to the peak [s]",
        value=float(motion.end_time[number]),
        limit=_LONGEST_SWING,
    )


def _backwards(door: Door) -> Ratios:
    """Return ratios with which the door closes as it opens when time runs backwards.

    With time -t eq. (1) keeps its form, but damping and friction change their sign.
    """
    ratios = door.ratios()
    beyond = -np.asarray(ratios.backcheck)
    below = -np.asarray(ratios.opening)
    return Ratios(
        opening=beyond, closing=beyond, backcheck=beyond, latch=below, spring=ratios.spring,
        preload=ratios.preload, friction=-np.asarray(ratios.friction),
        latch_angle=ratios.backcheck_angle)
