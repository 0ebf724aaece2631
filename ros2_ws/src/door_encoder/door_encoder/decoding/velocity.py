"""Angular velocity of the door from its counts, for fast and for slow motion."""

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.errors import SettingError
from door_model.recording.counts import Counts

LONGEST = 1.0  # longest window, for a door that hardly moves [s]
ENOUGH = 5  # [counts] in a window: the slope is then within about 6 % of a steady speed


@dataclass(frozen=True)
class Velocity:
    """An angular velocity and its delay.

    Attributes:
        omega: Angular velocity [rad/s].
        delay: Time before the newest sample to which the angular velocity belongs [s]: half of the
            window.
    """

    omega: float
    delay: float


class VelocityEstimator:
    r"""Least-squares slope over a window that grows until the count has moved.

    The slope over `N` samples of period `T` is the velocity in the middle of the
    window, so it lags by `(N - 1) T / 2`. If `n` counts fall into the window,
    quantisation causes an error of up to about `1.5 / n^2` of a steady speed; a fixed short
    window therefore cannot measure a slow door. The window used here is the shortest one that has
    at least `window` samples and contains a motion of `ENOUGH` counts, but it is never longer than
    `LONGEST`. With a shortest window of 50 ms and 14,400 counts per turn:

    - Above 0.044 rad/s (5 counts in 50 ms) the window is the shortest one. A slope that comes from
      a longer window is below 0.065 rad/s, because the slope of a motion over `R` counts is
      at most `1.5 R / (N T)`. A hit is therefore detected as early as by the shortest window
      alone.
    - Below 0.044 rad/s the delay is the time of 2.5 counts, up to half of `LONGEST`.
    - Below 0.0022 rad/s (5 counts in `LONGEST`) the error is up to 0.00065 rad/s (1.5 counts in
      `LONGEST`).

    When a door has come to rest, the window still contains counts of its motion. A door that has
    not moved by a count for some time was not faster than one count in that time, so the estimate
    is limited to this speed.

    Until there are `window` samples, as after a gap, the estimate is 0 unless the count has moved
    by `ENOUGH`: a single count over a few samples would look like a hit.
    """

    def __init__(self, *, period: float, window: int, radians_per_count: float) -> None:
        """Set the sampling and the shortest window.

        Args:
            period: Time between two samples [s].
            window: Number of samples in the shortest window.
            radians_per_count: Angle of a count [rad].

        Raises:
            SettingError: The window has fewer than two samples.
        """
        if window < 2:
            raise SettingError("window [samples]", window, "2 or more")
        self._period = period
        self._window = window
        self._scale = radians_per_count / period
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

    def velocity(self) -> Velocity:
        """Estimate the velocity from the samples added until now."""
        back = self._counts[::-1]
        if not len(back):
            return Velocity(0.0, 0.0)
        span = np.maximum.accumulate(back) - np.minimum.accumulate(back)
        size = int(np.searchsorted(span, ENOUGH)) + 1  # the newest samples that span ENOUGH
        enough = size <= len(back)
        size = min(max(size, self._window), len(back))
        delay = 0.5 * (size - 1) * self._period
        if size < self._window and not enough:
            return Velocity(0.0, delay)
        slope = _slope(back[:size][::-1])
        still = int(np.searchsorted(span, 1)) - 1  # newest periods without a change
        if size > self._window and abs(slope) * still > 1.0:
            slope = math.copysign(1.0 / still, slope)
            delay = 0.5 * still * self._period
        return Velocity(slope * self._scale, delay)


def _slope(counts: Counts) -> float:
    """Return the least-squares slope of two or more counts [counts/sample]."""
    t = np.arange(len(counts)) - 0.5 * (len(counts) - 1)
    return float(t @ (counts - counts[0]) / (t @ t))
