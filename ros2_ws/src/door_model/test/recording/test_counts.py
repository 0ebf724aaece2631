"""The zero of a door that stands still."""

import numpy as np
from door_model.recording.counts import stationary_zero


def test_zero_needs_a_door_that_stands_still() -> None:
    """A moving door gives no zero, and a flickering count its mean."""
    assert stationary_zero(np.arange(40), 20) is None
    assert stationary_zero(np.array([5] * 10), 20) is None
    assert stationary_zero(np.array([5, 6] * 10), 20) == 5.5
