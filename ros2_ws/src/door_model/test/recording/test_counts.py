"""Counter values that become unwrapped counts."""

import numpy as np
from door_model.recording.counts import stationary_zero, unwrap, wrap
from hypothesis import given
from hypothesis import strategies as st


@given(
    modulus=st.sampled_from([7, 256, 14400, 2**16, 2**32, 2**62]),
    start=st.integers(-(2**40), 2**40),
    shares=st.lists(st.floats(-0.49, 0.49), max_size=60),
)
def test_unwrap_inverts_wrap(modulus: int, start: int, shares: list[float]) -> None:
    """Steps below half the range are restored up to a constant, for any width of the counter."""
    steps = [int(share * min(modulus, 2**40)) for share in shares]
    counts = start + np.cumsum(np.array([0, *steps], dtype=np.int64))
    found = unwrap(wrap(counts, modulus), modulus)
    np.testing.assert_array_equal(found - found[0], counts - counts[0])


@given(
    modulus=st.sampled_from([256, 2**16]),
    steps=st.lists(st.integers(-100, 100), min_size=2, max_size=60),
    cut=st.integers(1, 59),
)
def test_unwrap_goes_on_across_batches(modulus: int, steps: list[int], cut: int) -> None:
    """Values that are cut in two give the same counts."""
    values = wrap(np.cumsum(np.array(steps, dtype=np.int64)), modulus)
    whole = unwrap(values, modulus)
    head = unwrap(values[:cut], modulus)
    tail = unwrap(values[cut:], modulus, (int(values[:cut][-1]), int(head[-1])))
    np.testing.assert_array_equal(np.concatenate([head, tail]), whole)


def test_zero_needs_a_door_that_stands_still() -> None:
    """A moving door gives no zero, and a flickering count its mean."""
    assert stationary_zero(np.arange(40), 20) is None
    assert stationary_zero(np.array([5] * 10), 20) is None
    assert stationary_zero(np.array([5, 6] * 10), 20) == 5.5
