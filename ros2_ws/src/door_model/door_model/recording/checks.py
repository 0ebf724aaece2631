"""Checks of a recording, and estimates of its resolution, noise and zero."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, median_filter

from door_model.errors import BadRecordingError
from door_model.recording.recording import Recording

_WINDOW = 0.06  # window of the running median [s]; a batch of 20 ms is a third of it
_DEVIATIONS = 3.0  # distance from the median from which a sample is garbage / scatter
_NORMAL = 1.4826  # standard deviation of a normal distribution / its median deviation
_COUNTS = 4.0  # least distance from the median of a garbage sample [counts]
_LEAST = np.radians(0.1)  # least distance from the median, and from zero, that matters [rad]
_PERIODS = (1e-5, 0.1)  # shortest and longest plausible time between samples [s]
_BUNCHED = 3.0  # samples come in bunches if mean / median of the time between them is larger
_FEWEST = 50  # fewest samples in which the encoder's steps are looked for
_ROUNDING = 1e-7  # angles that differ by less are equal [rad]
_ON_LATTICE = 0.1  # largest distance of an angle from a multiple of the step [steps]
_NEARLY_ALL = 0.98  # share of the angles that must be multiples of the step
_FEW_STEPS = 8.0  # largest motion between two samples of most of them [steps]
_EDGE_RMSE = 0.2  # residuals of the right model where counts are known [counts]
_RESTS_OFF = 2.0  # largest normal angle at which the door rests [counts]
_RESTS_LONG = 0.02  # share of the samples at one angle that shows that the door rests there
_LOW = np.radians(2.0)  # the door rests within this distance above the lowest angle [rad]
_FINEST = np.radians(0.005)  # finest step in which resting angles are distinguished [rad]
_DOWN = np.radians(2.0)  # least negative angle that shows a reversed direction [rad]
_FASTEST = 10.0  # greatest speed of a door [rad/s]


def garbage(recording: Recording) -> NDArray[np.bool_]:
    """Return which samples (N,) are garbage: far from their neighbours' median, at a leap.

    This is Hampel's test (Pearson, IEEE Transactions on Control Systems Technology 10, 2002). A
    door that moves in one direction passes the test at any speed, because its angle is the median.
    A door that bounces off its frame passes because its angle does not leap.
    """
    t, theta = recording.t, recording.theta
    half = max(2, round(0.5 * _WINDOW / float(np.median(np.diff(t))))) if len(t) > 1 else 2
    size = 2 * half + 1
    if len(t) < size:
        return np.zeros(len(t), dtype=bool)
    least = max(_COUNTS * recording.resolution, _LEAST)
    leaps = np.abs(np.diff(theta, prepend=theta[0])) > _FASTEST * np.diff(t, prepend=t[0]) + least
    near = maximum_filter(leaps, size, mode="nearest")
    away = np.abs(theta - _running_median(theta, half))
    scatter = _NORMAL * _running_median(away, half)
    return np.asarray(near & (away > _DEVIATIONS * scatter + least))


def _running_median(values: NDArray[np.float64], half: int) -> NDArray[np.float64]:
    """Return medians (N,) of windows; near the ends those of the first and the last window."""
    medians = median_filter(values, 2 * half + 1)
    medians[:half], medians[-half:] = medians[half], medians[-half - 1]
    return np.asarray(medians)


def without_garbage(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a recording without its garbage samples, and a warning about them."""
    bad = garbage(recording)
    if not bad.any():
        return recording, []
    at = recording.t[bad]
    rest = replace(recording, t=recording.t[~bad], theta=recording.theta[~bad])
    return rest, [
        f"{len(at)} sample(s) between {at[0]:.2f} and {at[-1]:.2f} s were left out: no door can "
        f"move like this (first: {np.degrees(recording.theta[bad][0]):.2f} deg)"
    ]


def require_times(recording: Recording) -> None:
    """Check that the times can be those of an encoder's samples in seconds.

    Raises:
        BadRecordingError: The samples are too close, too far apart, or come in bunches.
    """
    if len(recording.t) < 2:
        return
    steps = np.diff(recording.t)
    period = float(np.median(steps))
    if not _PERIODS[0] <= period <= _PERIODS[1]:
        raise BadRecordingError(
            "the recording", None,
            f"has a sample every {period:g} s, must be every {_PERIODS[0]:g} to {_PERIODS[1]:g} s: "
            "check that its times are in seconds", value=period, limit=_PERIODS)
    mean = float(steps[steps <= _PERIODS[1]].mean())
    if mean > _BUNCHED * period:
        raise BadRecordingError(
            "the recording", None,
            f"has its samples in bunches, {period:g} s apart within a bunch and {mean:g} s "
            "apart on average: check that the times are those of the samples",
            value=mean / period, limit=_BUNCHED)


def with_lattice(recording: Recording) -> Recording:
    """Return a recording with the encoder's step as resolution if its angles show such a step.

    They show it if a logger has written degrees: nearly all angles are then multiples of one step,
    and the door moves by few steps between two samples.
    """
    if recording.resolution > 0.0 or len(recording.t) < _FEWEST:
        return recording
    steps = np.diff(np.unique(recording.theta))
    steps = steps[steps > _ROUNDING]
    if not steps.size:
        return recording
    step = float(np.mean(steps[steps < 1.5 * np.median(steps)]))
    multiples = recording.theta / step
    off = np.abs(multiples - np.rint(multiples))
    jumps = np.abs(np.diff(multiples))
    if np.mean(off < _ON_LATTICE) < _NEARLY_ALL or np.percentile(jumps, 90) > _FEW_STEPS:
        return recording
    return replace(recording, resolution=step)


def grain(recording: Recording) -> float:
    """Return the root mean square of the residuals that the right model leaves [rad].

    If counts are known, it is a fifth of a count, because the changes of the count are fitted (the
    share was measured with simulated recordings). Otherwise it is the noise, estimated from the
    median of second differences.
    """
    if recording.resolution > 0.0 or len(recording.t) < 3:
        return _EDGE_RMSE * recording.resolution
    bends = np.abs(np.diff(recording.theta, n=2))
    return float(_NORMAL * np.median(bends) / math.sqrt(6.0))


def rest(recording: Recording) -> float:
    """Return the angle at which the door rests when it is lowest [rad]; 0 if it never rests."""
    if not recording.t.size:
        return 0.0
    low = recording.theta[recording.theta < np.percentile(recording.theta, 1.0) + _LOW]
    step = max(recording.resolution, _FINEST)
    places, times = np.unique(np.rint(low / step), return_counts=True)
    if times.max() < _RESTS_LONG * len(recording.theta):
        return 0.0
    return float(places[np.argmax(times)] * step)


def zero_doubts(recording: Recording) -> list[str]:
    """Return warnings if the door does not rest at zero, or its angle falls as it opens."""
    if not recording.t.size:
        return []
    low, high = float(recording.theta.min()), float(recording.theta.max())
    if -low > max(high, _DOWN):
        return [
            f"the angle falls to {np.degrees(low):.1f} deg: check that it grows as the door opens"]
    at = rest(recording)
    if abs(at) <= max(_RESTS_OFF * recording.resolution, _LEAST):
        return []
    return [
        f"the door rests at {np.degrees(at):.2f} deg: check that the encoder's zero is that of the "
        "shut door"]
