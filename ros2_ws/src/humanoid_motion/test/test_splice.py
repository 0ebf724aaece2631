"""Joining and re-timing knots."""

import numpy as np
import pytest
from humanoid_motion.knots import Knots
from humanoid_motion.splice import concatenate, cut, duration, slowed, without_first


def test_cut_and_without_first_keep_the_motion() -> None:
    """Cut, shortened, slowed and joined knots describe the same motion where they overlap."""
    knots = Knots(np.array([0.0, 1.0, 2.0]), np.array([[0.0], [0.5], [1.0]]),
                  np.full((3, 1), 0.5), np.zeros((3, 1)))
    np.testing.assert_allclose(cut(knots, 1.3).at(1.1)[0], knots.at(1.1)[0])
    assert cut(knots, 1.3).time[-1] == 1.3
    np.testing.assert_allclose(without_first(knots).at(1.5)[0], knots.at(1.5)[0])
    slow = slowed(knots, 0.5)
    np.testing.assert_allclose(slow.at(2.0)[0], knots.at(1.0)[0])
    np.testing.assert_allclose(slow.at(2.0)[1], 0.5 * knots.at(1.0)[1])
    assert duration(concatenate([knots, slow])) == pytest.approx(6.0)
