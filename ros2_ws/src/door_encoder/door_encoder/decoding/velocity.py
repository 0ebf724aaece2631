"""Angular velocity of a door from its counts, fast or slow."""

import math
from dataclasses import dataclass

import numpy as np

from door_encoder.decoding.counts import Counts
from door_encoder.errors import EncoderSettingError

LONGEST = 1.0  # [s] window of a door that hardly moves
ENOUGH = 5  # [counts] in a window: the slope is then within some 6 % of a steady speed


@dataclass(frozen=True)
class Velocity:
    """A velocity and how old it is.

    Attributes:
        omega: Angular velocity [rad/s].
        delay: It is that of so long before the newest sample [s]: half of the window.
    """

    omega: float
    delay: float


class VelocityEstimator:
    r"""Least-squares slope over a window that grows until the count has moved.

    The slope over :math:`N` samples of period :math:`T` is that of the middle of the window: it
    lags by :math:`(N - 1) T / 2`. Where :math:`n` counts fall into the window, quantisation leaves
    an error of up to about :math:`1.5 / n^2` of a steady speed, so a fixed window knows nothing of
    a slow door. The window is the shortest of at least `window` samples that has seen `ENOUGH`
    counts, and at most `LONGEST`. With a shortest window of 50 ms and 14,400 counts a turn:

    - above 0.044 rad/s (5 counts in 50 ms) the window is the shortest one. A slope that comes from
      a longer one is below 0.065 rad/s, since the slope of a motion over :math:`R` counts is at
      most :math:`1.5 R / (N T)`: a hit is seen as soon as by the shortest window alone;
    - below, the delay is the time of 2.5 counts, up to half of `LONGEST`;
    - below 0.0022 rad/s (5 counts in `LONGEST`) the error is up to 0.00065 rad/s (1.5 counts in
      it).

    A door that has come to rest leaves counts of its motion in the window. What has not moved by a
    count for a time was no faster than one count in it, which is the answer where it is less.

    Until there are `window` samples, as after a gap, the answer is 0 unless the count has moved by
    `ENOUGH`: a single count over a few samples would look like a hit.
    """

    def __init__(self, *, period: float, window: int, radians_per_count: float) -> None:
        """Set what does not change.

        Args:
            period: Time between two samples [s].
            window: Samples in the shortest window.
            radians_per_count: Angle of a count [rad].

        Raises:
            EncoderSettingError: The window holds less than two samples.
        """
        if window < 2:
            raise EncoderSettingError(
                f"the window must hold 2 samples or more, not {window}", value=window, limit=2
            )
        self._period = period
        self._window = window
        self._scale = radians_per_count / period
        self._longest = max(window, math.ceil(LONGEST / period))
        self.reset()

    def reset(self) -> None:
        """Forget all samples, as after a gap."""
        self._counts = np.empty(0, dtype=np.int64)

    def take(self, counts: Counts) -> None:
        """Take up counts (N,), in order of time."""
        self._counts = np.concatenate([self._counts, counts])[-self._longest :]

    def bridge(self, missing: int, count: int) -> None:
        """Take up missing samples as if the door had gone on evenly to the count after them."""
        between = np.linspace(self._counts[-1], count, missing + 2)[1:-1]
        self.take(np.rint(between).astype(np.int64))

    def velocity(self) -> Velocity:
        """Velocity by the samples so far."""
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
        still = int(np.searchsorted(span, 1)) - 1  # periods without a change
        if size > self._window and abs(slope) * still > 1.0:
            slope = math.copysign(1.0 / still, slope)
            delay = 0.5 * still * self._period
        return Velocity(slope * self._scale, delay)


def _slope(counts: Counts) -> float:
    """Least-squares slope of two counts or more [counts/sample]."""
    t = np.arange(len(counts)) - 0.5 * (len(counts) - 1)
    return float(t @ (counts - counts[0]) / (t @ t))
