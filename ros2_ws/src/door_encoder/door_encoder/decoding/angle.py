"""Decoded batches become angles and angular velocities at a lower rate."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from door_impact_common.errors import SettingError
from door_model.recording.batch import SampleBatch

from door_encoder.decoding.velocity import VelocityEstimator

_BRIDGED = 0.01  # longest gap over which the door is assumed to go on evenly [s]


@dataclass(frozen=True)
class AnglePoint:
    """Angle and angular velocity of the door at one sample.

    Attributes:
        stamp_ns: Time of the sample [ns].
        theta: Opening angle [rad].
        omega: Angular velocity [rad/s].
        delay: Time before the sample to which the angular velocity belongs [s], as described at
            `VelocityEstimator`.
    """

    stamp_ns: int
    theta: float
    omega: float
    delay: float


class AngleSampler:
    """Picks samples at a steady rate, for batches of any size."""

    def __init__(
        self, *, radians_per_count: float, rate: float = 100.0, window: float = 0.05
    ) -> None:
        """Set the properties of the output.

        Args:
            radians_per_count: Angle of one count [rad].
            rate: Rate of the angle points [Hz].
            window: Shortest window of the velocity [s].

        Raises:
            SettingError: The rate or the window is not a positive number.
        """
        for name, value in (("angle_rate", rate), ("velocity_window", window)):
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(name, value, "a positive number")
        self._radians_per_count = radians_per_count
        self._rate = rate
        self._window = window
        self._estimator: VelocityEstimator | None = None
        self._period = 0.0
        self._next = 0  # running number of the next sample

    def take(self, batch: SampleBatch) -> Iterator[AnglePoint]:
        """Return the points of a decoded batch: every n-th sample by its running number."""
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
