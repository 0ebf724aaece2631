"""Decoded batches to angle and angular velocity at a lower rate."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from door_encoder.decoding.batch import Decoded
from door_encoder.decoding.velocity import VelocityEstimator
from door_encoder.errors import EncoderSettingError

_BRIDGED = 0.01  # [s] of missing samples that leave the velocity as it is


@dataclass(frozen=True)
class AnglePoint:
    """Angle of the door at one sample.

    Attributes:
        stamp_ns: Time of the sample [ns].
        theta: Opening angle [rad].
        omega: Angular velocity [rad/s].
        delay: It is that of so long before the sample [s] (see `VelocityEstimator`).
    """

    stamp_ns: int
    theta: float
    omega: float
    delay: float


class AngleSampler:
    """Picks samples at a steady rate, whatever the size of the batches."""

    def __init__(
        self, *, radians_per_count: float, rate: float = 100.0, window: float = 0.05
    ) -> None:
        """Set angle of a count [rad], rate [Hz] and shortest window of the velocity [s].

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
        self._estimator: VelocityEstimator | None = None
        self._period = 0.0
        self._next = 0

    def take(self, batch: Decoded) -> Iterator[AnglePoint]:
        """Points of a batch: every n-th sample by its running number."""
        if self._estimator is None or batch.period != self._period:
            self._period = batch.period
            self._estimator = VelocityEstimator(
                period=batch.period,
                window=max(2, round(self._window / batch.period)),
                radians_per_count=self._radians_per_count,
            )
        elif batch.gap_before:
            missing = batch.first_index - self._next
            if 0 < missing <= _BRIDGED / batch.period:
                self._estimator.bridge(missing, int(batch.counts[0]))
            else:
                self._estimator.reset()
        self._next = batch.first_index + len(batch.counts)
        every = max(1, round(1.0 / (self._rate * batch.period)))
        done = 0
        for at in range(-batch.first_index % every, len(batch.counts), every):
            self._estimator.take(batch.counts[done : at + 1])
            done = at + 1
            velocity = self._estimator.velocity()
            yield AnglePoint(
                stamp_ns=batch.stamp_ns + round(at * batch.period * 1e9),
                theta=float(batch.counts[at] * self._radians_per_count),
                omega=velocity.omega,
                delay=velocity.delay,
            )
        self._estimator.take(batch.counts[done:])
