"""Tests of the state."""

import numpy as np
import pytest
from door_impact_view.live.state import STALE, Stamped, State

SQUARE = np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])


def state(now: float | None, zmp_time: float) -> State:
    """A state with joints of a time, a ZMP of a time, and a square support polygon."""
    polygon = Stamped(zmp_time if now is None else now, SQUARE)
    return State(now=now, zmp=Stamped(zmp_time, np.array([0.0, 0.13])), polygon=polygon)


def test_an_old_zmp_has_no_margin():
    """When the feet bear no load the last ZMP is not shown for ever, nor after a reset."""
    for now in (10.0, None):  # None: no joints are published
        assert state(now, 10.0 - 0.9 * STALE).margin() == pytest.approx(-0.03)  # it is outside
    assert state(10.0, 10.0 - 1.1 * STALE).margin() is None
    assert state(0.1, 10.0).margin() is None
    assert State().margin() is None


def test_a_polygon_without_area_has_no_margin():
    """Two corners are no error."""
    known = State(zmp=Stamped(1.0, np.zeros(2)), polygon=Stamped(1.0, SQUARE[:2]))
    assert known.margin() is None
