"""Knots of a planned motion: few points that a driver joins by quintics, not a dump of samples.

`Knots` is what a plan holds, cuts and joins: every knot has position, velocity and acceleration.
`humanoid_motion.spline.Spline` is the driver's side: it also follows points without velocities or
accelerations, and rests outside its knots. Both use the polynomial of `humanoid_motion.quintic`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike, NDArray

from humanoid_motion.motion import Motion
from humanoid_motion.quintic import quintic, rows

# [rad]; at 20 microradians the accelerations stray so far that the ZMP is 2 mm off in the run-up.
TOLERANCE = 5e-6


@dataclass(frozen=True)
class Knots:
    """Points of a piecewise quintic trajectory of J joints.

    Attributes:
        time: Rising, (K,) [s].
        position: (K, J) [rad].
        velocity: (K, J) [rad/s].
        acceleration: (K, J) [rad/s^2].
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array

    def __post_init__(self) -> None:
        """Check shapes and order."""
        k = len(self.time)
        for name in ("position", "velocity", "acceleration"):
            if getattr(self, name).shape[0] != k:
                raise ValueError(f"{name} has {getattr(self, name).shape[0]} rows, not {k}")
        if k < 2 or np.any(np.diff(self.time) <= 0.0):
            raise ValueError("knots need at least two rising times")

    def held_until(self, time: float) -> Knots:
        """These, standing still from their end until a time [s]."""
        still = np.zeros((1, self.position.shape[1]))
        return Knots(
            np.append(self.time, time),
            np.vstack([self.position, self.position[-1:]]),
            np.vstack([self.velocity, still]),
            np.vstack([self.acceleration, still]),
        )

    def at(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration at times (N,), each (N, J).

        Times outside the knots are held at the nearest end.
        """
        t = np.clip(np.atleast_1d(np.asarray(time, dtype=float)), self.time[0], self.time[-1])
        i = np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, len(self.time) - 2)
        coefficients = quintic(
            (self.time[i + 1] - self.time[i])[:, None],
            (self.position[i], self.velocity[i], self.acceleration[i]),
            (self.position[i + 1], self.velocity[i + 1], self.acceleration[i + 1]),
        )
        values = rows(t - self.time[i]) @ np.stack(coefficients, axis=1)
        return values[:, 0], values[:, 1], values[:, 2]


def from_samples(
    time: Array,
    position: Array,
    velocity: Array,
    acceleration: Array,
    tolerance: float = TOLERANCE,
) -> tuple[Knots, NDArray[np.int_]]:
    """Few knots whose spline stays within a tolerance of dense samples.

    Each knot is set as far from the one before as the tolerance allows.

    Args:
        time: Rising, (N,) [s].
        position: (N, J) [rad].
        velocity: (N, J) [rad/s].
        acceleration: (N, J) [rad/s^2].
        tolerance: Largest error at a sample [rad].

    Returns:
        The knots, and the indices of the samples that became knots, (K,).
    """
    moving = np.ptp(position, axis=0) > 0.1 * tolerance
    p, v, a = (rows[:, moving] for rows in (position, velocity, acceleration))
    last = len(time) - 1
    chosen = [0]
    stride = last
    while chosen[-1] < last:
        i = chosen[-1]

        def fits(j: int, i: int = i) -> bool:
            if j <= i + 1:
                return True
            spline = quintic(time[j] - time[i], (p[i], v[i], a[i]), (p[j], v[j], a[j]))
            powers = rows(time[i + 1 : j] - time[i])[:, 0]
            error = powers @ np.array(spline) - p[i + 1 : j]
            return bool(np.max(np.abs(error), initial=0.0) <= tolerance)  # nothing may move

        low, high = i + 1, min(i + max(2 * stride, 2), last)
        while low < high:
            middle = (low + high + 1) // 2
            if fits(middle):
                low = middle
            else:
                high = middle - 1
        stride = low - i
        chosen.append(low)
    index = np.array(chosen)
    return Knots(time[index], position[index], velocity[index], acceleration[index]), index


def from_motion(motion: Motion, tolerance: float = TOLERANCE) -> tuple[Knots, NDArray[np.int_]]:
    """Knots of a motion's joints; see `from_samples`."""
    return from_samples(
        motion.time, motion.joints, motion.joint_speed, motion.joint_acceleration, tolerance
    )
