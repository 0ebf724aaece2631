"""What is wrong with a recording, and what its samples can tell at best."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, median_filter

from door_model.errors import BadRecordingError
from door_model.recording.recording import Recording

_WINDOW = 0.06  # [s]; a batch of 20 ms is a third of it
_DEVIATIONS = 3.0  # of the window's own scatter
_NORMAL = 1.4826  # standard deviation of a normal scatter over its median deviation
_COUNTS = 4.0
_LEAST = np.radians(0.1)  # [rad]
_PERIODS = (1e-5, 0.1)  # [s] between samples
_BUNCHED = 3.0  # mean over median of the time between samples
_FEWEST = 50  # samples
_ROUNDING = 1e-7  # [rad]
_ON_LATTICE = 0.1  # steps; angles are written with few digits
_NEARLY_ALL = 0.98  # of the samples
_FEW_STEPS = 8.0  # from sample to sample
_EDGE_RMSE = 0.2  # counts
_RESTS_OFF = 2.0  # counts
_RESTS_LONG = 0.02  # of the samples, in one place
_LOW = np.radians(2.0)  # [rad] above the lowest
_FINEST = np.radians(0.005)  # [rad]
_DOWN = np.radians(2.0)  # [rad]
_FASTEST = 10.0  # [rad/s] that a door can do


def garbage(recording: Recording) -> NDArray[np.bool_]:
    """Which samples (N,) lie far from the median of those around them, where the angle leaps.

    Hampel's test (Pearson, IEEE Transactions on Control Systems Technology 10, 2002). A door that
    moves one way passes it at any speed, for its angle is then the median itself; one that bounces
    off its frame does not leap.
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
    """Medians (N,) of whole windows: at the ends those of the first and the last."""
    medians = median_filter(values, 2 * half + 1)
    medians[:half], medians[-half:] = medians[half], medians[-half - 1]
    return np.asarray(medians)


def without_garbage(recording: Recording) -> tuple[Recording, list[str]]:
    """A recording without such samples, and what to say of them."""
    bad = garbage(recording)
    if not bad.any():
        return recording, []
    at = recording.t[bad]
    rest = replace(recording, t=recording.t[~bad], theta=recording.theta[~bad])
    return rest, [
        f"{len(at)} sample(s) between {at[0]:.2f} and {at[-1]:.2f} s were left out: no door moves "
        f"as they do (first: {np.degrees(recording.theta[bad][0]):.2f} deg)"
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
            f"has a sample every {period:g} s, not every {_PERIODS[0]:g} to {_PERIODS[1]:g} s: are "
            "its times in seconds?", value=period, limit=_PERIODS)
    mean = float(steps[steps <= _PERIODS[1]].mean())
    if mean > _BUNCHED * period:
        raise BadRecordingError(
            "the recording", None,
            f"has its samples in bunches, {period:g} s apart within them and {mean:g} s on the "
            "average: are the times those of the samples?", value=mean / period, limit=_BUNCHED)


def with_lattice(recording: Recording) -> Recording:
    """A recording whose angles are seen to be an encoder's steps, with these as its resolution.

    A logger that writes degrees leaves them: nearly all angles are multiples of one step, and the
    door moves by few of them from sample to sample.
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
    """Residuals that the right model leaves of a recording [rad], root mean square.

    Where counts are known a fifth of one, as their changes are fitted (measured over simulated
    recordings), else the noise by the median of second differences.
    """
    if recording.resolution > 0.0 or len(recording.t) < 3:
        return _EDGE_RMSE * recording.resolution
    bends = np.abs(np.diff(recording.theta, n=2))
    return float(_NORMAL * np.median(bends) / math.sqrt(6.0))


def rest(recording: Recording) -> float:
    """Where the door rests at its lowest [rad]; 0 where it is not seen to."""
    if not recording.t.size:
        return 0.0
    low = recording.theta[recording.theta < np.percentile(recording.theta, 1.0) + _LOW]
    step = max(recording.resolution, _FINEST)
    places, times = np.unique(np.rint(low / step), return_counts=True)
    if times.max() < _RESTS_LONG * len(recording.theta):
        return 0.0
    return float(places[np.argmax(times)] * step)


def zero_doubts(recording: Recording) -> list[str]:
    """What to say of a recording whose door rests off its zero, or opens downwards."""
    if not recording.t.size:
        return []
    low, high = float(recording.theta.min()), float(recording.theta.max())
    if -low > max(high, _DOWN):
        return [
            f"the angle goes down to {np.degrees(low):.1f} deg: does it grow as the door opens?"]
    at = rest(recording)
    if abs(at) <= max(_RESTS_OFF * recording.resolution, _LEAST):
        return []
    return [
        f"the door rests at {np.degrees(at):.2f} deg: is the encoder's zero that of the shut door?"]
