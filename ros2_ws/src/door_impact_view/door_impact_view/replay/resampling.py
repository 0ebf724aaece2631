"""Choose the samples of a recording that a replay keeps, and interpolate values at them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array

SPARSE = 25.0  # samples a second far from every moment [1/s]
DENSE = ((1.0, 200.0), (0.15, 1000.0))
"""Distance from a moment [s], and samples a second up to there [1/s]."""
MOST = 20_000  # number of samples far from moments; a longer recording has fewer a second


def choose_stamps(t: Array, moments: Sequence[float], sparse: float = SPARSE) -> Array:
    """Choose sample times: many around the moments, few elsewhere, never more than there are.

    Args:
        t: Times of the recording's samples, (n,) [s], increasing, at least one.
        moments: Times around which the motion is fast, such as contacts [s].
        sparse: Samples a second far from every moment [1/s].

    Returns:
        Some of the times `t`, among them the first and the last one.
    """
    sparse = min(sparse, MOST / max(float(t[-1] - t[0]), 1e-9))
    distance = np.full(t.shape, np.inf)
    for moment in moments:
        distance = np.minimum(distance, np.abs(t - moment))
    rate = np.full(t.shape, sparse)
    for reach, dense in DENSE:
        rate[distance <= reach] = dense
    # A sample is kept when the number of samples wanted so far passes a whole number; the small
    # share keeps samples that come at the wanted rate itself from being lost by rounding.
    steps = rate[1:] * np.diff(t) * (1.0 + 1e-6)
    kept = np.zeros(t.shape, dtype=bool)
    kept[1:] = np.diff(np.floor(np.concatenate([[0.0], np.cumsum(np.minimum(steps, 1.0))]))) > 0
    kept[0] = kept[-1] = True
    return np.asarray(t[kept])


def at_stamps(t: Array, values: Array, stamps: Array) -> Array:
    """Return values at other times, by linear interpolation; before and after they stay.

    Args:
        t: Times of the values, (n,) [s], increasing, at least one.
        values: Values (n, k).
        stamps: Wanted times (N,) [s].

    Returns:
        Values (N, k).
    """
    columns = [np.interp(stamps, t, column) for column in values.T]
    return np.array(columns).reshape(values.shape[1], len(stamps)).T


def between(t: Array, values: Array, stamps: Array, longest: float) -> Array:
    """Return values as `at_stamps` does, but NaN in and around gaps longer than `longest` [s]."""
    found = at_stamps(t, values, stamps)
    index = np.searchsorted(t, stamps, side="right")
    before, after = t[np.maximum(index - 1, 0)], t[np.minimum(index, len(t) - 1)]
    inside = (index > 0) & (index < len(t))
    far = np.where(inside, after - before, np.minimum(abs(stamps - before), abs(after - stamps)))
    found[far > longest] = np.nan
    return found


def latest(t: Array, values: Array, stamps: Array, longest: float) -> Array:
    """Return the value before each time, NaN where it is older than `longest` [s].

    Args:
        t: Times of the values, (n,) [s], increasing, at least one.
        values: Values (n, ...).
        stamps: Wanted times (N,) [s].
        longest: Largest age [s].

    Returns:
        Values (N, ...).
    """
    index = np.searchsorted(t, stamps, side="right") - 1
    found = np.array(values[np.maximum(index, 0)], dtype=np.float64)
    found[(index < 0) | (stamps - t[np.maximum(index, 0)] > longest)] = np.nan
    return found


def poses_at_stamps(t: Array, poses: Array, stamps: Array) -> Array:
    """Return poses (N, 7) at other times; arguments as for `at_stamps`, poses (n, 7).

    Between two samples the quaternion is interpolated linearly and made a unit quaternion again,
    which is exact enough for samples that are a few degrees apart.
    """
    turns = np.array(poses[:, 3:])
    # The quaternions q and -q are the same orientation: the nearer one of each is taken.
    flips = np.sum(turns[1:] * turns[:-1], axis=1) < 0.0
    turns[1:] *= np.where(np.cumsum(flips) % 2 == 1, -1.0, 1.0)[:, None]
    found = at_stamps(t, np.hstack([poses[:, :3], turns]), stamps)
    found[:, 3:] /= np.linalg.norm(found[:, 3:], axis=1, keepdims=True)
    return found


def gaps(t: Array, longest: float) -> list[tuple[float, float]]:
    """Return begin and end of the times without samples that last longer than `longest` [s]."""
    where = np.flatnonzero(np.diff(t) > longest)
    return [(float(t[i]), float(t[i + 1])) for i in where]


def broken_at_gaps(t: Array, values: Array, longest: float) -> tuple[Array, Array]:
    """Put a NaN into each gap that lasts longer than `longest` [s], so that a curve breaks there.

    Args:
        t: Sample times (n,) [s], increasing.
        values: Values (n,).
        longest: Longest time between two samples that are joined [s].

    Returns:
        Times and values, (n + number of gaps,) each.
    """
    where = np.flatnonzero(np.diff(t) > longest)
    middle = 0.5 * (t[where] + t[where + 1])
    return np.insert(t, where + 1, middle), np.insert(values, where + 1, np.nan)
