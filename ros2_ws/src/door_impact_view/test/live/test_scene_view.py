"""Tests of the capture point."""

import math

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_view.live.scene_view import CaptureEstimator
from hypothesis import given
from hypothesis import strategies as st

places = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))


@given(places, places, st.floats(0.3, 1.2), st.lists(
    st.floats(0.001, 0.01), min_size=2, max_size=9))
def test_a_pendulum_on_its_capture_point_comes_to_rest_there(start, velocity, height, steps):
    """The linear inverted pendulum about the point has no growing part of its motion."""
    estimator = CaptureEstimator()
    for time in np.cumsum([5.0, *steps]):
        com = np.array([*(np.array(start) + (time - 5.0) * np.array(velocity)), height])
        point = estimator.update(time, com)
    assert point is not None
    omega = math.sqrt(GRAVITY / height)
    growing = com[:2] - point + np.array(velocity) / omega
    np.testing.assert_allclose(growing, 0.0, atol=1e-9)


def test_the_estimate_needs_three_samples_and_forgets_old_ones():
    """No point of one or two samples; samples older than the window have no effect."""
    estimator = CaptureEstimator()
    assert estimator.update(0.0, np.array([9.0, 9.0, 0.8])) is None
    assert estimator.update(0.02, np.array([9.0, 9.0, 0.8])) is None
    for step in range(1, 8):
        point = estimator.update(1.0 + 0.02 * step, np.array([0.3, 0.1, 0.8]))
    assert point == pytest.approx([0.3, 0.1])
