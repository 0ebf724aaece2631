"""Warnings about parameters that a fit's data do not determine."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from door_model.identification.parameters import UNITS, is_angle

_DOUBTFUL = 0.1  # standard deviation that causes a warning, relative to the value
_PART = 0.3  # smallest component with which a parameter takes part in an uncertain direction
_NOTHING = 1e-3  # a value below this many standard deviations is at its bound of 0


def doubts(
    names: Sequence[str], values: NDArray[np.float64], covariance: NDArray[np.float64]
) -> list[str]:
    """Return sentences on the directions in which parameters are uncertain by more than a tenth.

    Args:
        names: Names of the parameters (P,), as in the module `parameters`.
        values: Values of the parameters (P,), in SI units.
        covariance: Covariance of the parameters (P, P), without the uncertainty of the scale,
            which has nothing to do with the swings.
    """
    std = np.sqrt(np.diag(covariance))
    size = np.maximum(np.maximum(np.abs(values), std), 1e-12)
    shares, directions = np.linalg.eigh(covariance / np.outer(size, size))
    warnings: dict[tuple[str, ...], str] = {}
    for variance, direction in sorted(
        zip(shares, directions.T, strict=True), key=lambda pair: -pair[0]
    ):
        share = math.sqrt(max(float(variance), 0.0))
        parts = tuple(
            name for name, part in zip(names, direction, strict=True) if abs(part) > _PART)
        if share > _DOUBTFUL and len(parts) > 1:
            warnings.setdefault(parts, (
                f"the swings cannot tell {' and '.join(parts)} apart: if they change together by "
                f"{min(share, 1.0):.0%}, the motion stays nearly the same"))
    together = {name for parts in warnings for name in parts}
    return [*warnings.values(), *(
        _uncertain(name, float(value), float(spread))
        for name, value, spread in zip(names, values, std, strict=True)
        if spread > _DOUBTFUL * abs(value) and name not in together)]


def _uncertain(name: str, value: float, std: float) -> str:
    """Return a sentence on the uncertainty of a single parameter."""
    unit = UNITS[name]
    if is_angle(name):
        value, std, unit = math.degrees(value), math.degrees(std), "deg"
    if abs(value) < _NOTHING * std:
        return f"{name} is at its bound of 0, +- {std:.2g} {unit}"
    return f"{name} is uncertain: {value:.3g} +- {std:.2g} {unit}"
