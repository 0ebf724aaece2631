"""Joining, cutting and re-timing of knots before they are sent to the driver."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from humanoid_motion.knots import Knots
from humanoid_motion.motion import min_jerk_course


def concatenate(parts: Sequence[Knots]) -> Knots:
    """Join successive phases, each of which begins in the posture in which the preceding one ends.

    Where two phases meet, the knot of the earlier phase is kept.
    """
    time, position, velocity, acceleration = [], [], [], []
    offset = 0.0
    for number, part in enumerate(parts):
        first = 0 if number == 0 else 1
        time.append(offset + part.time[first:] - part.time[0])
        position.append(part.position[first:])
        velocity.append(part.velocity[first:])
        acceleration.append(part.acceleration[first:])
        offset += duration(part)
    return Knots(np.concatenate(time), np.vstack(position), np.vstack(velocity),
                 np.vstack(acceleration))


def slowed(knots: Knots, scale: float) -> Knots:
    """Slow a motion down to a share of its speed, 0 < scale <= 1."""
    return Knots(knots.time / scale, knots.position, knots.velocity * scale,
                 knots.acceleration * scale**2)


def cut(knots: Knots, time: float) -> Knots:
    """Keep the knots up to a time [s] between the first and the last, and set a knot there."""
    position, velocity, acceleration = knots.at(time)
    kept = knots.time < time - 1e-6
    return Knots(
        np.append(knots.time[kept], time),
        np.vstack([knots.position[kept], position]),
        np.vstack([knots.velocity[kept], velocity]),
        np.vstack([knots.acceleration[kept], acceleration]),
    )


def shifted(knots: Knots, off: NDArray[np.float64], fades_in: float) -> Knots:
    """Displace a motion by an offset that fades out smoothly.

    Args:
        knots: The motion; the offset is complete at its time 0.
        off: Offset of the joints, (J,) [rad].
        fades_in: Time within which the offset fades out [s]; infinite for a constant offset.
    """
    faded, speed, acceleration = (
        rows[:, None] for rows in min_jerk_course(knots.time, fades_in))
    return Knots(knots.time, knots.position + off * (1.0 - faded), knots.velocity - off * speed,
                 knots.acceleration - off * acceleration)


def without_first(knots: Knots) -> Knots:
    """Drop the first knot, so that a driver begins at its present reference instead."""
    return Knots(knots.time[1:], knots.position[1:], knots.velocity[1:], knots.acceleration[1:])


def duration(knots: Knots) -> float:
    """Return the time from the first knot to the last [s]."""
    return float(knots.time[-1] - knots.time[0])
