"""Values with their first two derivatives at N samples, and how they combine."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
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

    def plus(self, other: Course) -> Course:
        """Add another course of the same shape."""
        return Course(*(one + two for one, two in zip(self, other, strict=True)))


def central(values: Array, step: float) -> Course:
    """Differentiate values before, at and after each sample, (3, ...), a step [s] apart."""
    before, here, after = values
    return Course(
        here, (after - before) / (2.0 * step), (before - 2.0 * here + after) / step**2)
