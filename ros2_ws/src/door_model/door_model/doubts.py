"""What a fit's covariance says that its data cannot tell."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_DOUBTFUL = 0.1  # of a parameter's value
_PART = 0.3  # of a direction of the parameters


def doubts(names: Sequence[str], values: NDArray[np.float64],
           covariance: NDArray[np.float64]) -> list[str]:
    """Sentences on the directions in which parameters are uncertain by more than a tenth.

    Args:
        names: Names of the parameters (P,).
        values: Their values (P,).
        covariance: (P, P), without the scale, whose spread says nothing of the swings.
    """
    size = np.maximum(np.abs(values), 1e-12)
    shares, directions = np.linalg.eigh(covariance / np.outer(size, size))
    said = []
    for variance, direction in zip(shares, directions.T, strict=True):
        share = float(np.sqrt(max(variance, 0.0)))
        if share <= _DOUBTFUL:
            continue
        parts = [name for name, part in zip(names, direction, strict=True) if abs(part) > _PART]
        if len(parts) == 1:
            place = names.index(parts[0])
            std = float(np.sqrt(covariance[place, place]))
            said.append(f"{parts[0]} is uncertain: {values[place]:.3g} +- {std:.2g}")
        else:
            said.append(
                f"the swings cannot tell {' and '.join(parts)} apart: together they may be off by "
                f"{share:.0%} with next to no change of the motion")
    return said
