"""Values with their first two derivatives at N samples, and how they combine."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.spline import evaluate, quintic
from numpy.typing import ArrayLike


class Course(NamedTuple):
    """A course of M values at N samples.

    Attributes:
        value: The values, (N, M) or (N,).
        speed: Their derivatives by time [1/s].
        acceleration: Their second derivatives [1/s^2].
    """

    value: Array
    speed: Array
    acceleration: Array

    @classmethod
    def constant(cls, value: ArrayLike, count: int) -> Course:
        """Return values (M,) or a number that stay the same at all samples."""
        rows = np.tile(np.asarray(value, dtype=float), (count, *[1] * np.ndim(value)))
        return cls(rows, np.zeros_like(rows), np.zeros_like(rows))

    def around(self, step: float) -> Array:
        """Extrapolate to a step [s] before each sample, the sample, and a step after it, (3, ...).

        Central differences of what follows from these values have its exact first two derivatives,
        but for errors of the order step^2.
        """
        ahead, bend = step * self.speed, 0.5 * step**2 * self.acceleration
        return np.stack([self.value - ahead + bend, self.value, self.value + ahead + bend])

    def times(self, factor: Course) -> Course:
        """Multiply with another course of the same shape."""
        return Course(
            self.value * factor.value,
            self.speed * factor.value + self.value * factor.speed,
            self.acceleration * factor.value + 2.0 * self.speed * factor.speed
            + self.value * factor.acceleration)

    def row(self, sample: int) -> Course:
        """Return the values at one sample, (M,)."""
        return Course(*(rows[sample] for rows in self))

    def plus(self, other: Course) -> Course:
        """Add another course of the same shape."""
        return Course(*(one + two for one, two in zip(self, other, strict=True)))


def central(values: Array, step: float) -> Course:
    """Differentiate values before, at and after each sample, (3, ...), a step [s] apart."""
    before, here, after = values
    return Course(
        here, (after - before) / (2.0 * step), (before - 2.0 * here + after) / step**2)


def to_rest(begin: Course, end: Array, duration: float, time: Array) -> Course:
    """Compute a course from a state to rest, a quintic.

    Args:
        begin: Value, speed and acceleration at time 0, (M,) each.
        end: Value at rest, (M,).
        duration: Time to rest [s].
        time: Times, (N,) [s].
    """
    d, zero = duration, np.zeros_like(end)
    c = quintic(begin.value, begin.speed * d, begin.acceleration * d * d, end, zero, zero)
    value, speed, acceleration = evaluate(c, np.clip(time / d, 0.0, 1.0))
    moves = (time < d - 1e-9)[:, None]
    return Course(value, np.where(moves, speed / d, 0.0), np.where(moves, acceleration / d**2, 0.0))
