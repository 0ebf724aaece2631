"""Finds the free swings in a recording of pushes by hand."""

import math
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from scipy.signal import find_peaks, savgol_filter

from door_model.recording.recording import Recording

MIN_PEAK = math.radians(4.0)  # smallest peak of a swing; smaller ones may be bounces [rad]
CLOSING_END = math.radians(2.0)  # a fall is fitted down to here, above the bounces [rad]
_BEYOND_PEAK = math.radians(0.2)  # fall after the peak that still belongs to the opening [rad]
_SMOOTHING = 0.05  # window of the smoothing polynomial [s]
_BASE = 0.25  # a swing begins where it last rises above this share of its peak
_AFTER_HAND = 0.6  # time from the top speed to the free motion / time from onset to top speed
_MIN_RISE = math.radians(1.5)  # least rise from the start of the free motion to the peak [rad]
_MIN_SAMPLES = 25
_LONGEST_GAP = 0.1  # longest gap in a swing: five batches of 20 ms [s]
_TOP = math.radians(0.05)  # the top of a swing begins this far below the peak [rad]
_TURN = 0.04  # time before the top in which a stop would show [s]
_HARD_TURN = 4.0  # a door was stopped if it decelerates harder than before by this factor
_SOFT_TURN = 1.0  # deceleration that a closer alone may cause [rad/s^2]
_EDGE_ERROR = 0.1  # error of the place of a line of the encoder [counts]


@dataclass(frozen=True)
class FreeSwing:
    """Samples of one swing from the start of its free motion.

    Attributes:
        t: Sample times, strictly increasing, (N,) [s].
        theta: Opening angles (N,) [rad].
        peak_index: Index of the sample at which the door turns round.
        start_speed: Approximate angular velocity at the start [rad/s].
        errors: Expected errors of the angles (N,) [rad]; None means that all are equal.
        stopped: Whether something other than the closer stopped the door at its peak.
    """

    t: Array
    theta: Array
    peak_index: int
    start_speed: float
    errors: Array | None = None
    stopped: bool = False

    @property
    def weights(self) -> Array:
        """Weights of the angles in a least squares (N,); their mean square is 1."""
        if self.errors is None:
            return np.ones(len(self.t))
        weights = 1.0 / self.errors
        return np.asarray(weights / np.sqrt(np.mean(weights**2)))

    def opening(self) -> "FreeSwing":
        """Return the swing up to a little after its peak.

        If it ended at the peak, quantisation errors of the slowest samples would not cancel: in 25
        recordings of 5 swings c_c came out 6 % too large, and only 1 % with this method.
        """
        beyond = self.theta[self.peak_index :] < self.theta[self.peak_index] - _BEYOND_PEAK
        end = self.peak_index + int(np.argmax(beyond)) if beyond.any() else len(self.theta)
        errors = None if self.errors is None else self.errors[:end]
        return replace(self, t=self.t[:end], theta=self.theta[:end], errors=errors)

    def at_edges(self, resolution: float) -> "FreeSwing":
        """Return the swing at the changes of the count, with angles between the two counts.

        A sample may be wrong by half a count, and the samples of a slow door are all wrong in the
        same direction. A change of the count is known to half a sample period, which is a very
        small angle near the peak, and its error is random. In 14 recordings of 5 swings with play
        this lowered the error of c_c from 8 % to 2 %.

        Args:
            resolution: Angle of a count [rad].
        """
        counts = np.rint(self.theta / resolution)
        edge = np.flatnonzero(np.diff(counts))
        top = max(0, int(np.searchsorted(edge, self.peak_index)) - 1)
        t = 0.5 * (self.t[edge] + self.t[edge + 1])
        theta = 0.5 * resolution * (counts[edge] + counts[edge + 1])
        speed = np.abs(np.gradient(theta, t)) if len(t) > 1 else np.zeros(len(t))
        errors = np.hypot(speed * np.diff(self.t)[edge], _EDGE_ERROR * resolution)
        return replace(self, t=t, theta=theta, peak_index=top, errors=errors)


def smooth(theta: Array, period: float, derivative: int = 0) -> Array:
    """Smooth or differentiate evenly spaced angles by a local polynomial over 50 ms.

    Args:
        theta: Angles (N,) [rad].
        period: Time between two samples [s].
        derivative: 0 for the angle, 1 for the angular velocity, 2 for the acceleration.
    """
    window = max(5, 2 * round(0.5 * _SMOOTHING / period) + 1)
    if len(theta) < window:
        return np.zeros_like(theta) if derivative else theta
    return np.asarray(savgol_filter(theta, window, 2, deriv=derivative, delta=period), dtype=float)


@dataclass(frozen=True)
class FoundSwings:
    """Swings that were found in a recording.

    Attributes:
        swings: Free swings, in order of time.
        other_tops: Times at which the door turned round without a free swing before [s]: it was
            pushed again before it had fallen shut, or the recording begins during the swing.
    """

    swings: list[FreeSwing]
    other_tops: list[float]


def find_swings(recording: Recording, start_angle: float | None = None) -> list[FreeSwing]:
    """Return the free swings of a recording, as `search` finds them."""
    return search(recording, start_angle).swings


def search(recording: Recording, start_angle: float | None = None) -> FoundSwings:
    """Search a recording for free swings.

    The free motion of a swing starts when the hand has certainly left the door: after the greatest
    speed, by 0.6 of the time from the onset of the push to the greatest speed. It ends at 2 deg, or
    at the peak if the door did not fall to 2 deg by itself.

    Args:
        recording: The recording.
        start_angle: Angle at which the free motions start [rad] (paper: 10 deg); it is used if the
            hand has left the door by then and the peak is at least 4 deg higher. None means
            that it is not limited.
    """
    swings: list[FreeSwing] = []
    other_tops: list[float] = []
    if len(recording.t) < _MIN_SAMPLES:
        return FoundSwings(swings, other_tops)
    period = float(np.median(np.diff(recording.t)))
    breaks = np.flatnonzero(np.diff(recording.t) > max(_LONGEST_GAP, 2.5 * period)) + 1
    for piece in np.split(np.arange(len(recording.t)), breaks):
        if len(piece) >= _MIN_SAMPLES:
            t, theta = recording.t[piece], recording.theta[piece]
            found = _search_piece(t, theta, period, start_angle)
            swings += found.swings
            other_tops += found.other_tops
    return FoundSwings(swings, other_tops)


def _search_piece(t: Array, theta: Array, period: float, start_angle: float | None) -> FoundSwings:
    """Search a part of a recording that has no long gaps."""
    even = t[0] + np.arange(round((t[-1] - t[0]) / period) + 1) * period
    filled = np.interp(even, t, theta)
    smoothed = smooth(filled, period)
    speed = smooth(filled, period, derivative=1)
    tops = _tops(smoothed)
    swings, other_tops = [], []
    for number, top in enumerate(tops):
        before = tops[number - 1] if number else 0
        after = tops[number + 1] if number + 1 < len(tops) else len(even) - 1
        start = _free_start(smoothed, speed, before, top, start_angle)
        if start is None or top - start < _MIN_SAMPLES:
            other_tops.append(float(even[top]))
            continue
        end = _free_end(smoothed, top, after)
        first, peak, last = np.searchsorted(t, even[[start, top, end]] - 0.5 * period)
        window = slice(first, last + 1)
        swings.append(
            FreeSwing(t[window], theta[window], int(peak - first), max(float(speed[start]), 1e-3),
                      stopped=_is_stopped(smoothed[start:], speed[start:], top - start, period)))
    return FoundSwings(swings, other_tops)


def _is_stopped(smoothed: Array, speed: Array, top: int, period: float) -> bool:
    """Return whether a door came to its peak faster than its deceleration before explains.

    Only the rise is used, because after the peak the encoder's play hides the motion.
    """
    turn = round(_TURN / period)
    reached = int(np.argmax(smoothed[: top + 1] >= smoothed[top] - _TOP))
    last, before = max(0, reached - turn), max(0, reached - 5 * turn)
    if last == before:
        return False
    slowing = float(speed[before] - speed[last]) / ((last - before) * period)
    return bool(speed[last] > 2.0 * _TURN * max(_HARD_TURN * slowing, _SOFT_TURN))


def _tops(smoothed: Array) -> list[int]:
    """Return the indices of the samples at which the door turns round, one for each swing."""
    fall = 0.5 * MIN_PEAK
    tops: list[int] = []
    for top in find_peaks(smoothed, height=MIN_PEAK, prominence=fall)[0]:
        # Quantisation splits a peak into equal maxima, all of which are prominent.
        if tops and smoothed[tops[-1] : top].min() > min(smoothed[tops[-1]], smoothed[top]) - fall:
            if smoothed[top] > smoothed[tops[-1]]:
                tops[-1] = int(top)
        else:
            tops.append(int(top))
    return tops


def _free_start(
    smoothed: Array, speed: Array, before: int, top: int, start_angle: float | None
) -> int | None:
    """Return the first sample of the free motion; None if too little of the rise is left."""
    bottom = before + int(np.argmin(smoothed[before : top + 1]))
    low = np.flatnonzero(smoothed[bottom:top] <= _BASE * smoothed[top])
    if not low.size:
        return None  # the recording starts during the swing, or the door was caught high up
    base = bottom + int(low[-1])
    # The onset of the push is where the speed was last negligible.
    fastest = bottom + int(np.argmax(speed[bottom:top]))
    still = np.flatnonzero(speed[bottom:fastest] <= 0.05 * speed[fastest])
    onset = bottom + (int(still[-1]) if still.size else 0)
    start = fastest + round(_AFTER_HAND * (fastest - onset)) + 1
    start = max(start, min(base, fastest))
    if start_angle is not None and smoothed[top] >= start_angle + math.radians(4.0):
        start = max(start, bottom + int(np.argmax(smoothed[bottom:top] >= start_angle)))
    if start >= top or smoothed[top] - smoothed[start] < _MIN_RISE:
        return None
    return start


def _free_end(smoothed: Array, top: int, after: int) -> int:
    """Return the last sample of the free motion: above the frame, or the peak if caught."""
    fallen = np.flatnonzero(smoothed[top : after + 1] <= CLOSING_END)
    return top + int(fallen[0]) if fallen.size else top
