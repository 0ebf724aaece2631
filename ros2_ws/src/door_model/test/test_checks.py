"""Checks of numbers."""

import numpy as np
import pytest
from door_model.checks import require_covariance
from door_model.errors import DoorParameterError
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

SIDE = 4
SLOPES = arrays(float, (SIDE, SIDE), elements=st.floats(-1.0, 1.0))
SCALES = arrays(float, SIDE, elements=st.floats(-12.0, 12.0)).map(lambda power: 10.0**power)


UNDERFLOW = np.where(np.eye(SIDE) * (np.arange(SIDE) == 0.0), 2.9e-171, 1.0)


@given(SLOPES, SCALES)
@example(UNDERFLOW, np.full(SIDE, 1e10))
def test_every_covariance_of_random_numbers_passes(slopes: np.ndarray, scales: np.ndarray) -> None:
    """Sums of independent numbers have such a covariance, whatever their units and their number."""
    for rank in range(SIDE + 1):
        part = scales[:, None] * slopes[:, :rank]
        require_covariance("covariance", part @ part.T)


@given(SLOPES, SCALES, st.floats(1e-3, 1e3))
def test_a_direction_of_negative_variance_is_refused(
    slopes: np.ndarray, scales: np.ndarray, depth: float
) -> None:
    """One direction is enough, even where every variance and every pair is possible."""
    covariance = slopes @ slopes.T + np.eye(SIDE)
    values, directions = np.linalg.eigh(covariance)
    values[0] = -depth
    covariance = directions @ np.diag(values) @ directions.T
    with pytest.raises(DoorParameterError, match="covariance"):
        require_covariance("covariance", scales * covariance * scales[:, None])
