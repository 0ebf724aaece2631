"""Raw counter values become unwrapped counts; the zero is found while the door stands still."""

import numpy as np
from door_impact_common.errors import SettingError
from numpy.typing import NDArray

Counts = NDArray[np.int64]

LARGEST_COUNT = 2**61  # no counter gets there, and differences stay within 64 bits
_LARGEST_MODULUS = 2**62


def check_modulus(modulus: int) -> None:
    """Check the number of counts at which a counter wraps (0: it never wraps).

    Raises:
        SettingError: No counter can wrap at this number.
    """
    if modulus < 0 or modulus == 1 or modulus > _LARGEST_MODULUS:
        raise SettingError("counter_modulus", modulus, "0 (it never wraps) or 2 to 2^62")


def wrap(counts: Counts, modulus: int) -> Counts:
    """Return the values of a counter that wraps from modulus - 1 to 0."""
    check_modulus(modulus)
    return np.asarray(counts, dtype=np.int64) % modulus if modulus else np.array(counts)


def difference(value: int, reference: int, modulus: int) -> int:
    """Return the smallest step from a reference to a value of a counter that wraps (0: never)."""
    step = value - reference
    return (step + modulus // 2) % modulus - modulus // 2 if modulus else step


def unwrap(values: Counts, modulus: int, last: tuple[int, int] | None = None) -> Counts:
    """Return the counts that a counter would show if it did not wrap.

    Neighbouring samples must be less than half the counter's range apart; then unwrapping inverts
    wrapping up to a constant. Only differences of values count, so a counter that is read as a
    signed number needs no other treatment.

    Args:
        values: Counter values (N,), in order of time.
        modulus: Number of counts after which the counter wraps; 0 if it never does.
        last: The counter value before the first one, and its unwrapped count; None at the start.

    Returns:
        Unwrapped counts (N,).

    Raises:
        SettingError: The modulus is out of range.
    """
    check_modulus(modulus)
    values = np.asarray(values, dtype=np.int64)
    if not values.size:
        return values.copy()
    value, unwrapped = (int(values[0]), int(values[0])) if last is None else last
    steps = np.diff(values, prepend=np.int64(value))
    if modulus:
        half = modulus // 2
        steps = (steps + half) % modulus - half
    return np.asarray(unwrapped + np.cumsum(steps), dtype=np.int64)


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
