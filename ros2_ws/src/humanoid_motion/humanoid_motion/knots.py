"""Knots of a planned motion: few points that a driver joins by quintics, not a dump of samples.

`Knots` is what a plan holds, cuts and joins: every knot has position, velocity and acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike, NDArray

from humanoid_motion.motion import Motion
from humanoid_motion.spline import Spline, quintic

# Largest error of the joints between knots [rad]; with 2e-5 rad the accelerations err so much that
# the ZMP of the run-up is 2 mm off.
TOLERANCE = 5e-6


@dataclass(frozen=True)
class Knots:
    """Points of a piecewise quintic trajectory of J joints.

    Attributes:
        time: Times of the knots, strictly increasing, (K,) with K >= 2 [s].
        position: Positions of the joints, (K, J) [rad].
        velocity: Velocities of the joints, (K, J) [rad/s].
        acceleration: Accelerations of the joints, (K, J) [rad/s^2].

    Raises:
        ValueError: Shapes differ, times do not increase, or there are fewer than two knots.
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array

    def __post_init__(self) -> None:
        """Check shapes and the order of the times."""
        k = len(self.time)
        for name in ("position", "velocity", "acceleration"):
            if getattr(self, name).shape[0] != k:
                raise ValueError(f"{name} has {getattr(self, name).shape[0]} rows, not {k}")
        if k < 2 or np.any(np.diff(self.time) <= 0.0):
            raise ValueError("knots need at least two times, and rising ones")

    def held_until(self, time: float) -> Knots:
        """Return these knots and one more at a time [s], until which the joints stand still."""
        still = np.zeros((1, self.position.shape[1]))
        return Knots(
            np.append(self.time, time),
            np.vstack([self.position, self.position[-1:]]),
            np.vstack([self.velocity, still]),
            np.vstack([self.acceleration, still]),
        )

    def at(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Compute the motion at some times.

        Args:
            time: Times, (N,) or a number [s]; times outside the knots count as the nearest knot's.

        Returns:
            Positions [rad], velocities [rad/s] and accelerations [rad/s^2], (N, J) each.
        """
        return self._spline.states(np.atleast_1d(np.asarray(time, dtype=float)))

    @cached_property
    def _spline(self) -> Spline:
        return Spline(self.time, self.position, self.velocity, self.acceleration)


def from_samples(
    time: Array,
    position: Array,
    velocity: Array,
    acceleration: Array,
    tolerance: float = TOLERANCE,
) -> tuple[Knots, NDArray[np.int_]]:
    """Reduce dense samples to few knots whose spline stays within a tolerance of the samples.

    Each knot is set as far behind the preceding knot as the tolerance allows.

    Args:
        time: Times of the samples, strictly increasing, (N,) [s].
        position: Positions of the joints, (N, J) [rad].
        velocity: Velocities of the joints, (N, J) [rad/s].
        acceleration: Accelerations of the joints, (N, J) [rad/s^2].
        tolerance: Largest error of a position at a sample [rad].

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
            h = time[j] - time[i]
            spline = quintic(p[i], v[i] * h, a[i] * h**2, p[j], v[j] * h, a[j] * h**2)
            powers = np.vander((time[i + 1 : j] - time[i]) / h, 6, increasing=True)
            error = powers @ spline - p[i + 1 : j]  # may be empty, so `initial`
            return bool(np.max(np.abs(error), initial=0.0) <= tolerance)

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


def from_motion(motion: Motion) -> Knots:
    """Reduce a motion of the joints to knots, as `from_samples` does."""
    return from_samples(
        motion.time, motion.joints, motion.joint_speed, motion.joint_acceleration)[0]
