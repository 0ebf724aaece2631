"""The search for the pair of shapes that comes nearest to its limit during a motion.

Few samples have to be computed. A point of a body moves by at most its distance from a joint's
axis times the joint's travel. So two bodies that are d_a and d_b apart at samples a and b are at
least (d_a + d_b - travel) / 2 apart in between (Schwarzer, Saha and Latombe, "Adaptive dynamic
collision checking", IEEE T-RO 21(3), 2005). An interval of samples is halved only where this bound
allows a new minimum; the result is that of computing every pair at every sample. Signed distances
of convex shapes obey the bound also when they are negative.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import NDArray

Indices = NDArray[np.int_]

_RESOLUTION = 1e-6  # differences of distances below this do not count; coal is no better [m]


@dataclass(frozen=True)
class Clearance:
    """The pair of bodies that comes nearest to its limit during a motion.

    Attributes:
        bodies: Names of the two bodies; empty if no pair counts.
        distance: Distance between the two bodies, negative if they overlap [m]; infinite if no
            pair counts.
        limit: Distance that these two bodies must keep [m].
        time: Time since the start of the motion [s].
    """

    bodies: tuple[str, ...]
    distance: float
    limit: float
    time: float


@dataclass(frozen=True)
class Pairs:
    """Pairs of shapes whose distances are computed.

    Attributes:
        geometry: Pinocchio's geometry model, with P collision pairs.
        data: Pinocchio's work space of this geometry model.
        names: Names of the two bodies of each pair.
        slopes: Upper bounds of the change of each distance with each of M coordinates, (P, M)
            [m/rad, m/m].
    """

    geometry: Any
    data: Any
    names: list[tuple[str, str]]
    slopes: Array


def nearest(
    pairs: Pairs,
    course: Array,
    distances: Callable[[int, Indices], Array],
    required: Array,
    time: Array,
) -> Clearance:
    """Find the smallest distance in excess of the required one, by branch and bound.

    Args:
        pairs: P pairs of shapes.
        course: Coordinates that move the shapes, at N samples, (N, M) [rad, m].
        distances: Function that computes the distances [m] of some pairs at a sample.
        required: Distance that each pair must keep, (P,) [m].
        time: Times of the samples, (N,) [s].

    Returns:
        The pair and the sample at which distance less required distance is smallest.
    """
    if not pairs.names:
        return Clearance((), np.inf, 0.0, 0.0)
    travel = np.zeros(course.shape)
    np.cumsum(np.abs(np.diff(course, axis=0)), axis=0, out=travel[1:])
    best = (np.inf, 0, 0)  # excess distance [m], pair, sample

    def excess(sample: int, which: Indices) -> Array:
        nonlocal best
        left = distances(sample, which) - required[which]
        least = int(np.argmin(left))
        best = min(best, (float(left[least]), int(which[least]), sample))
        return left

    # Intervals, those with the smallest possible excess first: this excess, first and last sample,
    # pairs that may have it, their excess at the first and at the last sample.
    heap: list[tuple[float, int, int, Indices, Array, Array]] = []

    def add(a: int, b: int, which: Indices, at_a: Array, at_b: Array) -> None:
        if b - a < 2:
            return
        possible = 0.5 * (at_a + at_b - pairs.slopes[which] @ (travel[b] - travel[a]))
        least, enough = float(possible.min()), best[0] - _RESOLUTION
        if least < enough:
            keep = possible < enough
            heapq.heappush(heap, (least, a, b, which[keep], at_a[keep], at_b[keep]))

    every, last = np.arange(len(pairs.names)), len(course) - 1
    moving = np.flatnonzero(pairs.slopes @ travel[last] > 0.0)
    at_first = excess(0, every)[moving]
    if moving.size:
        add(0, last, moving, at_first, excess(last, moving))
    while heap and heap[0][0] < best[0] - _RESOLUTION:
        _, a, b, which, at_a, at_b = heapq.heappop(heap)
        middle = (a + b) // 2
        at_middle = excess(middle, which)
        add(a, middle, which, at_a, at_middle)
        add(middle, b, which, at_middle, at_b)
    left, pair, sample = best
    limit = float(required[pair])
    return Clearance(pairs.names[pair], left + limit, limit, float(time[sample]))
