"""Decoded batches become angles and angular velocities at a lower rate."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from door_impact_common.errors import SettingError
from door_model.recording.batch import SampleBatch
from door_model.recording.counts import Counts

LONGEST = 1.0  # longest window, for a door that hardly moves [s]
ENOUGH = 5  # [counts] in a window: the slope is then within about 6 % of a steady speed
_BRIDGED = 0.01  # longest gap over which the door is assumed to go on evenly [s]


@dataclass(frozen=True)
class AnglePoint:
    """Angle and angular velocity of the door at one sample."""

    stamp_ns: int  # time of the sample [ns]
    theta: float  # opening angle [rad]
    omega: float  # angular velocity [rad/s]
    delay: float  # time before the sample to which omega belongs [s]: half of the window


class AngleSampler:
    """Picks samples at a steady rate, for batches of any size."""

    def __init__(
        self, *, radians_per_count: float, rate: float = 100.0, window: float = 0.05
    ) -> None:
        """Set the angle of a count [rad], the rate [Hz] and the shortest window of velocity [s].

        Raises:
            SettingError: The rate or the window is not a positive number.
        """
        for name, value in (("angle_rate", rate), ("velocity_window", window)):
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(name, value, "a positive number")
        self._radians_per_count, self._rate, self._window = radians_per_count, rate, window
        self._estimator: VelocityEstimator | None = None
        self._period = 0.0
        self._next = 0  # running number of the next sample

    def take(self, batch: SampleBatch) -> Iterator[AnglePoint]:
        """Return the points of a decoded batch: every n-th sample by its running number."""
        if self._estimator is None or batch.period != self._period:
            self._period = batch.period
            self._estimator = VelocityEstimator(
                period=batch.period, window=max(2, round(self._window / batch.period)))
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
            speed, delay = self._estimator.velocity()
            yield AnglePoint(
                stamp_ns=batch.stamp_ns + round(at * batch.period * 1e9),
                theta=float(batch.counts[at] * self._radians_per_count),
                omega=speed * self._radians_per_count,
                delay=delay)
        self._estimator.take(batch.counts[done:])


class VelocityEstimator:
    r"""Least-squares slope over a window that grows until the count has moved.

    The slope is the velocity in the middle of the window. If `n` counts fall into the window,
    quantisation causes an error of up to about `1.5 / n^2` of a steady speed; a fixed short window
    therefore cannot measure a slow door. The window used here is the shortest one that has at least
    `window` samples and contains a motion of `ENOUGH` counts, but it is never longer than
    `LONGEST`. Over `N` samples of period `T` the slope of a motion by `R` counts is at most
    `1.5 R / (N T)`, so that a hit is seen as early as by the shortest window alone.

    A door that has not moved by a count for some time was not faster than one count in that time,
    so the estimate is limited to this speed. Until there are `window` samples, as after a gap, the
    estimate is 0 unless the count has moved by `ENOUGH`: a single count over a few samples would
    look like a hit.
    """

    def __init__(self, *, period: float, window: int) -> None:
        """Set the period [s] and the number of samples, two or more, in the shortest window."""
        self._period, self._window = period, window
        self._longest = max(window, math.ceil(LONGEST / period))
        self.reset()

    def reset(self) -> None:
        """Forget all samples, as after a gap."""
        self._counts = np.empty(0, dtype=np.int64)

    def take(self, counts: Counts) -> None:
        """Add counts (N,), in order of time."""
        self._counts = np.concatenate([self._counts, counts])[-self._longest :]

    def bridge(self, missing: int, count: int) -> None:
        """Add missing samples as if the door had moved evenly to the count that follows them."""
        between = np.linspace(self._counts[-1], count, missing + 2)[1:-1]
        self.take(np.rint(between).astype(np.int64))

    def velocity(self) -> tuple[float, float]:
        """Estimate velocity [counts/s] and its delay [s] from the samples until now."""
        back = self._counts[::-1]
        if not len(back):
            return 0.0, 0.0
        span = np.maximum.accumulate(back) - np.minimum.accumulate(back)
        size = int(np.searchsorted(span, ENOUGH)) + 1  # the newest samples that span ENOUGH
        enough = size <= len(back)
        size = min(max(size, self._window), len(back))
        delay = 0.5 * (size - 1) * self._period
        if size < self._window and not enough:
            return 0.0, delay
        slope = _slope(back[:size][::-1])
        still = int(np.searchsorted(span, 1)) - 1  # newest periods without a change
        if size > self._window and abs(slope) * still > 1.0:
            slope = math.copysign(1.0 / still, slope)
            delay = 0.5 * still * self._period
        return slope / self._period, delay


def _slope(counts: Counts) -> float:
    """Return the least-squares slope of two or more counts [counts/sample]."""
    t = np.arange(len(counts)) - 0.5 * (len(counts) - 1)
    return float(t @ (counts - counts[0]) / (t @ t))
