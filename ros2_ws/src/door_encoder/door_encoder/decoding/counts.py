"""Counter values to unwrapped, zeroed counts."""

import numpy as np
from numpy.typing import NDArray

from door_encoder.errors import EncoderSettingError

Counts = NDArray[np.int64]

LARGEST_COUNT = 2**61  # no counter gets there; differences stay within 64 bits


def check_modulus(modulus: int) -> None:
    """Raise EncoderSettingError unless a counter may wrap at this many counts (0: never)."""
    if modulus < 0 or modulus == 1 or modulus > 2**62:
        raise EncoderSettingError(
            f"a counter wraps at 2 .. 2^62 counts, or never (0), not at {modulus}",
            value=modulus,
            limit="0 or 2 .. 2^62",
        )


def wrap(counts: Counts, modulus: int) -> Counts:
    """Values of a counter that wraps from modulus - 1 to 0."""
    check_modulus(modulus)
    return np.asarray(counts, dtype=np.int64) % modulus if modulus else np.array(counts)


def difference(value: int, reference: int, modulus: int) -> int:
    """The smallest step from a reference to a value on a counter that wraps (0: never)."""
    step = value - reference
    return (step + modulus // 2) % modulus - modulus // 2 if modulus else step


def unwrap(values: Counts, modulus: int, last: tuple[int, int] | None = None) -> Counts:
    """Counts of a counter that wraps, as if it did not.

    Neighbouring samples must be less than half the counter's range apart; then unwrapping
    inverts wrapping up to a constant. A counter that reads signed values needs no other
    treatment, since only differences count.

    Args:
        values: Counter values (N,), in order of time.
        modulus: Counts after which the counter wraps; 0 if it never does.
        last: The last counter value before and what it was unwrapped to; None at the start.

    Returns:
        Unwrapped counts (N,).

    Raises:
        EncoderSettingError: The modulus is out of range.
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
    """Mean of the first samples if the door stood still over them.

    Args:
        counts: Unwrapped counts (N,).
        samples: How many of them to use.
        tolerance: Largest spread that counts as standing still [counts].

    Returns:
        The mean count, None where there are too few samples or the door moves.
    """
    if samples <= 0 or len(counts) < samples:
        return None
    head = counts[:samples]
    if int(head.max() - head.min()) > tolerance:
        return None
    return float(head.mean())
