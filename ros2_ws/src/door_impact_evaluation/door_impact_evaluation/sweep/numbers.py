"""Statistics of a sweep's figures; what is not known is None or NaN, and left out."""

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
from door_impact_common.arrays import Array

Figure = float | None
Statistic = Callable[[Iterable[Figure]], dict[str, Figure]]
"""Function that summarizes figures; each of its values is None if no figure is known."""


def known(values: Iterable[Figure]) -> Array:
    """Return the figures that are known, (n,)."""
    return np.array([value for value in values if value is not None and math.isfinite(value)],
                    dtype=float)


def smallest(values: Iterable[Figure]) -> dict[str, Figure]:
    """Compute the 5th percentile and the minimum of margins."""
    return _of(known(values), p5=lambda found: np.percentile(found, 5.0), min=np.min)


def largest(values: Iterable[Figure]) -> dict[str, Figure]:
    """Compute the 95th percentile and the maximum of sizes."""
    return _of(np.abs(known(values)), p95=lambda found: np.percentile(found, 95.0), max=np.max)


def statistics(errors: Iterable[Figure]) -> dict[str, Figure]:
    """Compute mean and standard deviation of errors, 95th percentile and maximum of their sizes."""
    found = known(errors)
    sd = partial(np.std, ddof=min(1, len(found) - 1))  # of a single error it is 0
    return {**_of(found, mean=np.mean, sd=sd), **largest(found)}


def _of(found: Array, **statistics: Callable[[Array], Any]) -> dict[str, Figure]:
    return {name: float(of(found)) if len(found) else None for name, of in statistics.items()}
