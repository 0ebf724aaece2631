"""Differences of a counter's values, and the zero of a door that stands still."""

import numpy as np
from numpy.typing import NDArray

Counts = NDArray[np.int64]

LARGEST_COUNT = 2**61  # no counter gets there, and differences stay within 64 bits


def difference(value: int, reference: int, modulus: int) -> int:
    """Return the smallest step from a reference to a value of a counter that wraps (0: never)."""
    step = value - reference
    return (step + modulus // 2) % modulus - modulus // 2 if modulus else step


def stationary_zero(counts: Counts, samples: int, tolerance: int = 2) -> float | None:
    """Return the mean of the first samples if the door stood still during them.

    Args:
        counts: Unwrapped counts (N,).
        samples: Number of samples to use.
        tolerance: Largest spread of the counts of a door that stands still.

    Returns:
        The mean count; None if there are too few samples or the door moves.
    """
    if samples <= 0 or len(counts) < samples:
        return None
    head = counts[:samples]
    if int(head.max() - head.min()) > tolerance:
        return None
    return float(head.mean())
