"""Joining and re-timing knots before they go to the driver."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from humanoid_motion.knots import Knots
from humanoid_motion.motion import min_jerk_course


def concatenate(parts: Sequence[Knots]) -> Knots:
    """One trajectory from phases that follow each other, each beginning where the last one ends.

    Where two phases meet, the knot of the earlier one is kept.
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
    """The same motion at a share of its speed, 0 < scale <= 1."""
    return Knots(knots.time / scale, knots.position, knots.velocity * scale,
                 knots.acceleration * scale**2)


def cut(knots: Knots, time: float) -> Knots:
    """The knots up to a time [s] inside them, with a knot there."""
    position, velocity, acceleration = knots.at(time)
    kept = knots.time < time - 1e-6
    return Knots(
        np.append(knots.time[kept], time),
        np.vstack([knots.position[kept], position]),
        np.vstack([knots.velocity[kept], velocity]),
        np.vstack([knots.acceleration[kept], acceleration]),
    )


def shifted(knots: Knots, off: NDArray[np.float64], fades_in: float) -> Knots:
    """The same motion with its joints off by (J,) [rad], which fade smoothly from time 0 on [s].

    An infinite time keeps them.
    """
    way, speed, acceleration = (
        rows[:, None] for rows in min_jerk_course(knots.time, fades_in))
    return Knots(knots.time, knots.position + off * (1.0 - way), knots.velocity - off * speed,
                 knots.acceleration - off * acceleration)


def without_first(knots: Knots) -> Knots:
    """The knots from the second on: a driver then begins from where its reference is."""
    return Knots(knots.time[1:], knots.position[1:], knots.velocity[1:], knots.acceleration[1:])


def duration(knots: Knots) -> float:
    """From the first knot to the last [s]."""
    return float(knots.time[-1] - knots.time[0])
