"""Checks of a recording, and estimates of its resolution, noise and zero."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import (
    maximum_filter,
    maximum_filter1d,
    median_filter,
    minimum_filter1d,
    uniform_filter1d,
)

from door_model.errors import BadRecordingError
from door_model.recording.recording import Recording
from door_model.recording.sensor import FASTEST, STANDS

_WINDOW = 0.06  # window of the running median [s]; a batch of 20 ms is a third of it
_DEVIATIONS = 3.0  # distance from the median from which a sample is garbage / scatter
_NOISY = 6.0  # a step is no noise if it is larger than expected by this many deviations
_NORMAL = 1.4826  # standard deviation of a normal distribution / its median deviation
_COUNTS = 4.0  # least distance from the median of a garbage sample [counts]
_LEAST = np.radians(0.1)  # least distance from the median, and from zero, that matters [rad]
_PERIODS = (1e-5, 0.1)  # shortest and longest plausible time between samples [s]
_BUNCHED = 3.0  # samples come in bunches if mean / median of the time between them is larger
_FEWEST = 50  # fewest samples in which the encoder's steps are looked for
_SINGLE = 1.2  # least leap of a single missing row [counts]
_MANY, _SIDED = 10, 3  # such leaps show missing rows from so many on, and so many times those back
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
_LONGEST_GAP = 0.1  # longest gap that is not named [s]: five batches of 20 ms
_LEAP = np.radians(1.0)  # least leap that no door makes [rad]
_DRIFT = np.radians(0.5)  # largest drift of the shut door [rad]
_UNKNOWN = np.radians(1e-3)  # residuals [rad] below which nothing is known about a sensor


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
    leaps = np.abs(np.diff(theta, prepend=theta[0])) > FASTEST * np.diff(t, prepend=t[0]) + least
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

    They show it if a logger has written degrees, and the door moves by few steps between two
    samples.
    """
    step = _step(recording)
    if recording.resolution > 0.0 or not step or (
        np.percentile(np.abs(np.diff(recording.theta)), 90) > _FEW_STEPS * step):
        return recording
    return replace(recording, resolution=step)


def _step(recording: Recording) -> float:
    """Return the step of which nearly all angles are multiples [rad]; 0 if there is none."""
    steps = np.diff(np.unique(recording.theta))
    steps = steps[steps > _ROUNDING]
    if not steps.size or len(recording.t) < _FEWEST:
        return 0.0
    step = float(np.mean(steps[steps < 1.5 * np.median(steps)]))
    multiples = recording.theta / step
    on = np.abs(multiples - np.rint(multiples)) < _ON_LATTICE
    return step if np.mean(on) >= _NEARLY_ALL else 0.0


def grain(recording: Recording) -> float:
    """Return the root mean square of the residuals that the right model leaves [rad].

    If counts are known, it is a fifth of a count, because the changes of the count are fitted (the
    share was measured with simulated recordings). Otherwise it is the noise, estimated from the
    median of second differences, and the rounding to the steps of the angles.
    """
    if recording.resolution > 0.0:
        return _EDGE_RMSE * recording.resolution
    if len(recording.t) < 3:
        return 0.0
    bends = np.abs(np.diff(recording.theta, n=2))
    noise = _NORMAL * float(np.median(bends)) / math.sqrt(6.0)
    return max(math.hypot(noise, _step(recording) / math.sqrt(12.0)), _UNKNOWN)


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
    """Return warnings if the door does not rest at zero, or opens to both sides of it."""
    if not recording.t.size:
        return []
    doubts, low = [], float(recording.theta.min())
    if low < -_DOWN:
        doubts.append(
            f"the angle falls to {np.degrees(low):.1f} deg, the shut door is at 0: check that it "
            "grows as the door opens, and that the door opens to one side only")
    at = rest(recording)
    if abs(at) > max(_RESTS_OFF * recording.resolution, _LEAST):
        doubts.append(
            f"the door rests at {np.degrees(at):.2f} deg: check that the encoder's zero is that of "
            "the shut door")
    return doubts


def require_continuity(recording: Recording) -> None:
    """Check that the door moves as a door can, and rests at one place where nobody holds it open.

    Raises:
        BadRecordingError: The angle leaps and stays there, or that of the shut door drifts.
    """
    t, theta = recording.t, recording.theta
    _, places = standing(recording)
    drifts = bool(places.size and np.ptp(places) > _DRIFT)
    least = max(_COUNTS * recording.resolution, _LEAP)
    fast = np.abs(np.diff(theta)) > FASTEST * np.diff(t) + least
    if not drifts:  # a counter that has lost nothing leaps ahead where rows are missing
        fast[missing_rows(recording)] = False
    if fast.any():
        at = int(np.argmax(fast))
        leap = float(theta[at + 1] - theta[at])
        raise BadRecordingError(
            "the recording", None,
            f"leaps {np.count_nonzero(fast)} time(s), first by {np.degrees(leap):.2f} deg at "
            f"{t[at]:.3f} s, as no door can and no counter's range explains: was the counter "
            "reset, did it lose counts, or does it wrap at another number?", value=leap,
            limit=least)
    if drifts:
        raise BadRecordingError(
            "the recording", None,
            f"has the shut door at {np.degrees(places.min()):.2f} to "
            f"{np.degrees(places.max()):.2f} deg, must stay within {np.degrees(_DRIFT):g} deg: "
            "does the encoder lose counts, or slip, or was the door ajar?",
            value=float(np.ptp(places)), limit=_DRIFT)


def missing_rows(recording: Recording) -> NDArray[np.intp]:
    """Return the samples (M,) behind which the angle leaps ahead, but not the time.

    Rows are missing there, and their times were numbered anew.
    """
    dt, steps = np.diff(recording.t), np.diff(recording.theta)
    half = max(2, round(0.5 * _WINDOW / float(np.median(dt)))) if dt.size else 2
    if len(steps) <= 2 * half:
        return np.empty(0, dtype=np.intp)
    expected = _running_median(steps / dt, half) * dt
    off = steps - expected
    noise = _NOISY * _NORMAL * float(np.median(np.abs(off)))
    least = max(_COUNTS * recording.resolution, _LEAST, noise)
    leaps = np.flatnonzero(np.sign(expected) * off > least)
    if leaps.size or not recording.resolution:
        return leaps
    # Single rows leap by a count or two: counting leaps by one at most, and noise to both sides.
    mean = uniform_filter1d(steps / dt, 2 * half + 1) * dt
    steady = np.abs(np.roll(mean, half) - np.roll(mean, -half)) < 0.5 * recording.resolution
    ahead = np.where(steady, np.sign(mean) * (steps - mean) / recording.resolution, 0.0)
    leaps, back = np.flatnonzero(ahead > _SINGLE), np.flatnonzero(ahead < -_SINGLE)
    return leaps if leaps.size > max(_MANY, _SIDED * back.size) else leaps[:0]


class Hold(NamedTuple):
    """A time in which the door stood open [s], and its last angle then [rad]."""

    start: float
    end: float
    angle: float

    def __str__(self) -> str:
        return f"{np.degrees(self.angle):.1f} deg from {self.start:.1f} to {self.end:.1f} s"


def standing(recording: Recording) -> tuple[list[Hold], NDArray[np.float64]]:
    """Return when the door was held open, and the angles (M,) at which it rests otherwise [rad].

    A door that is held falls shut afterwards, or stands there until the recording ends; behind an
    encoder that slipped, later swings begin and end at the new place.
    """
    t, theta = recording.t, recording.theta
    if len(t) < 2 or np.ptp(theta) < 2.0 * _DOWN:
        return [], np.empty(0)
    size = max(2, round(STANDS / float(np.median(np.diff(t)))))
    least = max(_RESTS_OFF * recording.resolution, _LEAST)
    low, high = (form(theta, size) for form in (minimum_filter1d, maximum_filter1d))
    still = np.flatnonzero(  # and lower than soon before and after
        (high - low <= least) & (minimum_filter1d(theta, 5 * size) >= low - least))
    rests = theta[still]
    ajar = rests > max(rests.min(initial=0.0), 0.0) + _DOWN
    held, shut = [], np.ones(len(still), dtype=bool)
    for run in np.split(np.arange(len(still)), np.flatnonzero(np.diff(ajar)) + 1):
        if not ajar[run].any():
            continue
        first, last = int(still[run[0]]), int(still[run[-1]])
        if run[-1] == len(still) - 1 and theta[first:last].max() > rests[run].max() + _DOWN:
            continue
        off = [np.flatnonzero(np.abs(theta - theta[at]) > least) for at in (first, last)]
        start = int(off[0][off[0] < first].max(initial=-1)) + 1
        end = int(off[1][off[1] > last].min(initial=len(t))) - 1
        held.append(Hold(float(t[start]), float(t[end]), float(theta[last])))
        shut[run] = False
    return held, np.asarray(rests[shut])


def gap_doubts(recording: Recording) -> list[str]:
    """Return a warning if samples are missing while the door was open."""
    t, theta = recording.t, recording.theta
    gaps = np.diff(t)
    open_ = np.maximum(theta[1:], theta[:-1]) > _DOWN
    longest = max(_LONGEST_GAP, 2.5 * float(np.median(gaps))) if len(gaps) else 0.0
    at = np.flatnonzero((gaps > longest) & open_)
    if not at.size:
        return []
    return [f"samples are missing {at.size} time(s) while the door was open, first for "
            f"{gaps[at[0]]:.2f} s at {t[at[0]]:.2f} s: a swing with a gap is cut there"]
