"""What a sensor shows becomes the door's angle: unwrapped, zero at the shut door, rising."""

import math

import numpy as np
from numpy.typing import NDArray

from door_model.errors import BadRecordingError

FASTEST = 10.0  # greatest speed of a door [rad/s]
_FLICKER = 4.0  # counts by which a count may be wrong
_COARSE = math.radians(0.1)  # angles that differ by less are one place, where the door rests [rad]
_RESTS_LONG = 0.02  # share of the samples at one place that shows that the door rests there
STANDS = 0.2  # shortest time for which a door stands still [s]
_NEAR = math.radians(2.0)  # a zero is believed if the door rests this close to it [rad]
_COUNTERS = tuple(2**bits for bits in range(8, 33))  # counts after which counters wrap
_INCREMENTAL = (2**8, 2**16, 2**24, 2**32)  # ... those of incremental encoders


def opening(
    t: NDArray[np.float64], values: NDArray[np.int64] | NDArray[np.float64],
    counts_per_turn: int | None, *, given: bool = True, own_zero: bool = True
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Return the opening angle that a sensor's values show.

    The values may wrap after a turn or, if they are counts, at a power of two. If their own zero is
    not believed, the door is shut where it comes to rest most often. The door opens to the side to
    which it moves from there.

    Args:
        t: Sample times, strictly increasing, (N,) [s].
        values: Counts or degrees (N,), at least one.
        counts_per_turn: Number of counts in a turn of the hinge; None: the values are degrees.
        given: Whether somebody has stated counts_per_turn; otherwise it is assumed.
        own_zero: Whether the values' own zero is believed if the door rests near it.

    Returns:
        Angles (N,) [rad], and what was assumed.

    Raises:
        BadRecordingError: The count wraps as that of an absolute sensor with another number of
            counts per turn than the assumed one.
    """
    turn, mark = (360, " deg") if counts_per_turn is None else (counts_per_turn, "")
    unit = 2.0 * math.pi / turn
    modulus = _range(t, values, unit, turn, counted=not mark)
    if modulus not in (0, turn, *_INCREMENTAL) and not given:
        raise BadRecordingError(
            "the recording", None,
            f"the count wraps at {modulus}, as that of a sensor with {modulus} counts per turn: "
            f"say how many a turn has (--counts-per-turn), {turn} is only assumed",
            value=modulus, limit=turn)
    moved = np.unwrap(values, period=modulus) if modulus else values
    moved = moved - values[0]
    zero = _zero(t, moved * unit, -values[0] * unit if own_zero else math.inf) / unit
    theta = (moved - (zero if mark else round(zero))) * unit
    away = theta[np.abs(theta) > _NEAR]
    falls = bool(away.size and np.median(away) < 0.0)
    shut = round(float(values[0] + zero), 3)
    said = {
        f"{turn} counts per turn{'' if given else ', since nobody has said how many'}": not mark,
        f"wraps at {modulus}{mark}": modulus,
        f"shut at {shut:.10g}{mark}, where the door rests most often": shut != 0.0,
        "falls as the door opens": falls}
    return -theta if falls else theta, tuple(text for text, holds in said.items() if holds)


def _range(
    t: NDArray[np.float64], values: NDArray[np.int64] | NDArray[np.float64], unit: float, turn: int,
    *, counted: bool,
) -> int:
    """Return the range at which values wrap; 0 if they do not.

    A wrap is a step by the range, which no door can make, and all values are within the range.
    """
    spread = np.ptp(np.percentile(values, [0.5, 99.5]))
    steps = np.abs(np.diff(values))
    reach = FASTEST * np.diff(t) / unit + (_FLICKER if counted else _COARSE / unit)
    fast = steps > reach
    steps, reach = steps[fast], reach[fast]
    wraps = {
        modulus: int(np.count_nonzero(
            np.abs(steps - modulus) <= np.minimum(reach, 0.25 * modulus)))
        for modulus in ((*_COUNTERS, turn) if counted else (turn,)) if spread <= modulus
    }
    best = max(wraps, key=lambda modulus: wraps[modulus], default=0)
    return best if best and 2 * wraps[best] >= max(len(steps), 1) else 0


def _zero(t: NDArray[np.float64], theta: NDArray[np.float64], own: float) -> float:
    """Return the angle of the shut door [rad]: `own` if the door rests near it.

    All angles lie on one side of the shut door, and it comes to rest there after each swing. Where
    it is held open, it may stand for longer.
    """
    places, times = np.unique(np.rint(theta / _COARSE), return_counts=True)
    least = _RESTS_LONG * len(theta)
    near = times[np.abs(places * _COARSE - own) <= _NEAR]
    if near.size and near.max() >= least:
        return own

    def rank(place: float) -> tuple[bool, int, int]:
        away = theta - place * _COARSE
        both = bool(min(np.sum(away < -_NEAR), np.sum(away > _NEAR)) > least)
        edges = np.diff(np.abs(away) <= _COARSE, prepend=False, append=False)
        begins, ends = np.flatnonzero(edges).reshape(-1, 2).T
        stays = int(np.count_nonzero(t[ends - 1] - t[begins] > STANDS))
        return both, -stays, -int(times[places == place][0])

    place = min(places[times >= min(least, times.max())].tolist(), key=rank) * _COARSE
    return float(np.median(theta[np.abs(theta - place) <= 0.5 * _COARSE * 1.001]))
