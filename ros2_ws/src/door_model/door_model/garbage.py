"""Samples of a recording that no door can have made, and a zero that is not the shut door's."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, median_filter

from door_model.recordings import Recording

_WINDOW = 0.06  # [s]; a batch of 20 ms is a third of it
_DEVIATIONS = 3.0  # of the window's own scatter
_NORMAL = 1.4826  # standard deviation of a normal scatter over its median deviation
_COUNTS = 4.0
_LEAST = np.radians(0.1)  # [rad]
_RESTS_OFF = np.radians(0.5)  # [rad]
_RESTS_LONG = 0.05  # of the samples, in one place
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
    rest = Recording(recording.t[~bad], recording.theta[~bad], recording.resolution)
    return rest, [
        f"{len(at)} sample(s) between {at[0]:.2f} and {at[-1]:.2f} s were left out: no door moves "
        f"as they do (first: {np.degrees(recording.theta[bad][0]):.2f} deg)"
    ]


def zero_doubts(recording: Recording) -> list[str]:
    """What to say of a recording whose door rests elsewhere than at its zero, or opens downwards.

    The door of a recording of pushes spends most of its rest shut.
    """
    if not recording.t.size:
        return []
    low, high = float(recording.theta.min()), float(recording.theta.max())
    if -low > max(high, _RESTS_OFF):
        return [
            f"the angle goes down to {np.degrees(low):.1f} deg: does it grow as the door opens?"]
    step = max(recording.resolution, _LEAST)
    places, times = np.unique(np.rint(recording.theta / step), return_counts=True)
    rest = float(places[np.argmax(times)] * step)
    if abs(rest) <= _RESTS_OFF or times.max() < _RESTS_LONG * len(recording.theta):
        return []
    return [
        f"the door rests at {np.degrees(rest):.2f} deg most of the time: is the encoder's zero "
        "that of the shut door?"
    ]
