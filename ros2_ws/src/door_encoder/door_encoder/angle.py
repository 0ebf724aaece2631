"""Decoded batches to angle and angular velocity at a lower rate."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from door_encoder.batch import Decoded
from door_encoder.errors import EncoderSettingError
from door_encoder.velocity import SlopeEstimator


@dataclass(frozen=True)
class AnglePoint:
    """Angle of the door at one sample.

    Attributes:
        stamp_ns: Time of the sample [ns].
        theta: Opening angle [rad].
        omega: Angular velocity [rad/s], of half a window ago (see `SlopeEstimator`).
    """

    stamp_ns: int
    theta: float
    omega: float


class AngleSampler:
    """Picks samples at a steady rate, whatever the size of the batches."""

    def __init__(
        self, *, radians_per_count: float, rate: float = 100.0, window: float = 0.05
    ) -> None:
        """Set rate [Hz] and window of the velocity [s].

        Raises:
            EncoderSettingError: One is not a positive number.
        """
        for name, value in (("rate", rate), ("window", window)):
            if not (math.isfinite(value) and value > 0.0):
                raise EncoderSettingError(
                    f"{name} must be a positive number, not {value}", value=value, limit=0
                )
        self._radians_per_count = radians_per_count
        self._rate = rate
        self._window = window
        self._slope: SlopeEstimator | None = None
        self._period = 0.0

    def take(self, batch: Decoded) -> Iterator[AnglePoint]:
        """Points of a batch: every n-th sample by its running number."""
        if self._slope is None or batch.period != self._period:
            self._period = batch.period
            self._slope = SlopeEstimator(max(2, round(self._window / batch.period)))
        elif batch.gap_before:
            self._slope.reset()
        every = max(1, round(1.0 / (self._rate * batch.period)))
        theta = np.asarray(batch.counts * self._radians_per_count, dtype=np.float64)
        done = 0
        for at in range(-batch.first_index % every, len(theta), every):
            omega = self._slope.update(theta[done : at + 1], batch.period)
            done = at + 1
            yield AnglePoint(
                stamp_ns=batch.stamp_ns + round(at * batch.period * 1e9),
                theta=float(theta[at]),
                omega=0.0 if np.isnan(omega) else omega,
            )
        self._slope.update(theta[done:], batch.period)
