"""Knots of a planned motion: few points that a driver joins by quintics, not a dump of samples.

`Knots` is what a plan holds, cuts and joins: every knot has position, velocity and acceleration.
`humanoid_motion.spline.Spline` is the driver's side: it also follows points without velocities or
accelerations, and rests outside its knots.

The quintic stands in both modules, here on [0, 1] and there in seconds, on purpose. With one form
in both, either plans or the driver's reference change by rounding (1e-16), and the simulated
contact amplifies that to up to 0.5 deg of the door's largest angle: every figure would change.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike, NDArray

from humanoid_motion.motion import Motion

# Largest error of the joints between knots [rad]; with 2e-5 rad the accelerations err so much that
# the ZMP of the run-up is 2 mm off.
TOLERANCE = 5e-6

# Coefficients of a quintic on [0, 1] from value, first and second derivative at 0 and at 1.
_QUINTIC = np.array([
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
    [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
    [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
    [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
])


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
        t = np.clip(np.atleast_1d(np.asarray(time, dtype=float)), self.time[0], self.time[-1])
        i = np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, len(self.time) - 2)
        h = (self.time[i + 1] - self.time[i])[:, None]
        c = quintic(
            self.position[i], self.velocity[i] * h, self.acceleration[i] * h**2,
            self.position[i + 1], self.velocity[i + 1] * h, self.acceleration[i + 1] * h**2,
        )
        x = ((t - self.time[i]) / h[:, 0])[:, None]
        position = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))))
        velocity = c[1] + x * (2 * c[2] + x * (3 * c[3] + x * (4 * c[4] + x * 5 * c[5])))
        acceleration = 2 * c[2] + x * (6 * c[3] + x * (12 * c[4] + x * 20 * c[5]))
        return position, velocity / h, acceleration / h**2


def quintic(*ends: Array) -> Array:
    """Compute the quintic on [0, 1] that has given values and derivatives at both ends.

    Args:
        ends: Value, first and second derivative at 0, then the same three at 1; six arrays (...).

    Returns:
        Coefficients of the powers 0 to 5, (6, ...).
    """
    stacked = np.array(ends)
    return np.asarray((_QUINTIC @ stacked.reshape(6, -1)).reshape(stacked.shape))


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


def from_motion(motion: Motion, tolerance: float = TOLERANCE) -> tuple[Knots, NDArray[np.int_]]:
    """Reduce a motion of the joints to knots, as `from_samples` does."""
    return from_samples(
        motion.time, motion.joints, motion.joint_speed, motion.joint_acceleration, tolerance
    )
