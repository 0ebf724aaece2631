"""Finding the free swings in a recording of pushes by hand."""

import math
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from scipy.signal import find_peaks, savgol_filter

from door_model.recording.recording import Recording

MIN_PEAK = math.radians(4.0)  # smaller swings tell nothing and may be bounces
CLOSING_END = math.radians(2.0)  # above the bounces against the frame
_BEYOND_PEAK = math.radians(0.2)
_SMOOTHING = 0.05  # [s]; window of the derivative
_BASE = 0.25  # a swing begins where it has risen above this share of its peak the last time
_AFTER_HAND = 0.6  # share of the time from the push's onset to the top speed that is added to it
_MIN_RISE = math.radians(1.5)  # from the start of the free motion to the peak
_MIN_SAMPLES = 25
_LONGEST_GAP = 0.1  # [s] in a swing: five batches of 50 a second
_TOP = math.radians(0.05)  # below the peak
_TURN = 0.04  # [s] before that
_HARD_TURN = 4.0  # deceleration from there on, over that before
_SOFT_TURN = 1.0  # [rad/s^2]; up to here a turn is soft anyhow
_EDGE_ERROR = 0.1  # counts; of a line of an encoder


@dataclass(frozen=True)
class FreeSwing:
    """Samples of one swing, from the free motion's start.

    Attributes:
        t: Times (N,) [s].
        theta: Opening angles (N,) [rad].
        peak_index: Sample at which the door turns round.
        start_speed: Rough angular velocity at the start [rad/s].
        errors: Expected errors of the angles (N,) [rad]; None: all alike.
        stopped: Something stopped the door at its peak: it turned round too hard for a closer.
    """

    t: Array
    theta: Array
    peak_index: int
    start_speed: float
    errors: Array | None = None
    stopped: bool = False

    @property
    def weights(self) -> Array:
        """Weights (N,) of the angles in a least squares, 1 on the average."""
        if self.errors is None:
            return np.ones(len(self.t))
        weights = 1.0 / self.errors
        return np.asarray(weights / np.sqrt(np.mean(weights**2)))

    def opening(self) -> "FreeSwing":
        """The swing up to a little beyond its peak.

        Cut on the last count at the top itself, quantisation errors of the slowest samples no
        longer cancel: over 25 recordings of 5 swings c_c came out 6 % too large, 1 % with this.
        """
        beyond = self.theta[self.peak_index :] < self.theta[self.peak_index] - _BEYOND_PEAK
        end = self.peak_index + int(np.argmax(beyond)) if beyond.any() else len(self.theta)
        errors = None if self.errors is None else self.errors[:end]
        return replace(self, t=self.t[:end], theta=self.theta[:end], errors=errors)

    def at_edges(self, resolution: float) -> "FreeSwing":
        """The moments at which the count changes, and the angles between its two values.

        A sample may be half a count off, all those of a slow door alike; a change is half a period
        off at most, which near the peak is nothing, and each by its own chance. Over 14 recordings
        of 5 swings with play the error of c_c fell from 8 % to 2 %.

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
    """Angle, angular velocity or acceleration by a local polynomial over 50 ms."""
    window = max(5, 2 * round(0.5 * _SMOOTHING / period) + 1)
    if len(theta) < window:
        return np.zeros_like(theta) if derivative else theta
    return np.asarray(savgol_filter(theta, window, 2, deriv=derivative, delta=period), dtype=float)


@dataclass(frozen=True)
class Found:
    """What was found in a recording.

    Attributes:
        swings: Free swings, in order of time.
        other_tops: Times [s] at which the door turned round, but not at the end of a free swing
            from below: it was pushed again before it had fallen shut, or the recording begins
            amid the swing.
    """

    swings: list[FreeSwing]
    other_tops: list[float]


def find_swings(recording: Recording, start_angle: float | None = None) -> list[FreeSwing]:
    """Free swings of a recording, see `search`."""
    return search(recording, start_angle).swings


def search(recording: Recording, start_angle: float | None = None) -> Found:
    """Look for the swings of a recording.

    A swing's free motion starts where the hand has certainly left: the speed is past its maximum
    by 0.6 of the time that the push took to reach it. It ends 2 deg before the closed door, or at
    its peak where the door did not fall that far by itself.

    Args:
        recording: The recording.
        start_angle: Take the swings from this angle on [rad], as the paper does from 10 deg, if
            the hand has left by then and the peak is at least 4 deg above it.
    """
    swings: list[FreeSwing] = []
    other_tops: list[float] = []
    if len(recording.t) < _MIN_SAMPLES:
        return Found(swings, other_tops)
    period = float(np.median(np.diff(recording.t)))
    breaks = np.flatnonzero(np.diff(recording.t) > max(_LONGEST_GAP, 2.5 * period)) + 1
    for piece in np.split(np.arange(len(recording.t)), breaks):
        if len(piece) >= _MIN_SAMPLES:
            t, theta = recording.t[piece], recording.theta[piece]
            found = _search_piece(t, theta, period, start_angle)
            swings += found.swings
            other_tops += found.other_tops
    return Found(swings, other_tops)


def _search_piece(
    t: Array, theta: Array, period: float, start_angle: float | None
) -> Found:
    """What is found in a recording without long gaps."""
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
    return Found(swings, other_tops)


def _is_stopped(smoothed: Array, speed: Array, top: int, period: float) -> bool:
    """Whether a door came to its peak faster than the way it slowed down before explains.

    Looked at on the way up alone: behind the peak the encoder's play hides how the door turns.
    """
    turn = round(_TURN / period)
    reached = int(np.argmax(smoothed[: top + 1] >= smoothed[top] - _TOP))
    last, before = max(0, reached - turn), max(0, reached - 5 * turn)
    if last == before:
        return False
    slowing = float(speed[before] - speed[last]) / ((last - before) * period)
    return bool(speed[last] > 2.0 * _TURN * max(_HARD_TURN * slowing, _SOFT_TURN))


def _tops(smoothed: Array) -> list[int]:
    """Samples at which the door turns round, one for each swing."""
    fall = 0.5 * MIN_PEAK
    tops: list[int] = []
    for top in find_peaks(smoothed, height=MIN_PEAK, prominence=fall)[0]:
        # Quantisation makes several maxima of one: equally high, they are all prominent.
        if tops and smoothed[tops[-1] : top].min() > min(smoothed[tops[-1]], smoothed[top]) - fall:
            if smoothed[top] > smoothed[tops[-1]]:
                tops[-1] = int(top)
        else:
            tops.append(int(top))
    return tops


def _free_start(
    smoothed: Array, speed: Array, before: int, top: int, start_angle: float | None
) -> int | None:
    """First sample of the free motion; None where too little of the rise is left."""
    bottom = before + int(np.argmin(smoothed[before : top + 1]))
    low = np.flatnonzero(smoothed[bottom:top] <= _BASE * smoothed[top])
    if not low.size:
        return None  # the recording starts amid the swing or the door was caught high up
    base = bottom + int(low[-1])
    # The push may have begun long before: its onset is where the speed was last negligible.
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
    """Last sample of the free motion: above the frame, or the peak if the door was caught."""
    fallen = np.flatnonzero(smoothed[top : after + 1] <= CLOSING_END)
    return top + int(fallen[0]) if fallen.size else top
