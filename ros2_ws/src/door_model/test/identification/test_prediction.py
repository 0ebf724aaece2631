"""The predicted peak and its uncertainty."""

import math
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.door.door import Door, Zone
from door_model.identification.parameters import PARAMETERS
from door_model.identification.prediction import predict_peak
from door_model.motion.dynamics import peak
from hypothesis import given, settings
from hypothesis import strategies as st

PAPER = load_door("paper").door()


def changed(door: Door, name: str, step: float) -> Door:
    """Return a door with one parameter slightly increased."""
    zone, part = door.backcheck, name.removeprefix("backcheck_")
    if part != name:
        return replace(door, backcheck=replace(zone, **{part: getattr(zone, part) + step}))
    return replace(door, **{name: getattr(door, name) + step})


@settings(max_examples=6)
@given(
    st.floats(0.02, 0.5), st.floats(0.3, 3.0), st.floats(3.0, 8.0), st.floats(0.01, 0.5),
    st.floats(0.4, 0.9), st.floats(0.0, 0.1))
def test_spread_by_each_parameter_is_the_peaks_own_slope(
    c_c: float, k_c: float, preload: float, friction: float, omega0: float, theta0: float
) -> None:
    """The derivatives agree with central differences of the peak, also with a backcheck."""
    start = replace(PAPER, c_c=c_c, k_c=k_c, tau_c0_prime=preload, friction=friction)
    middle = 0.5 * (theta0 + peak(start, theta0, omega0).angle)
    door = replace(start, backcheck=Zone(middle, 2.0 * c_c))
    for name in (*PARAMETERS, "friction", "backcheck_c_c", "backcheck_angle"):
        step = 1e-5
        high, low = (peak(changed(door, name, s), theta0, omega0) for s in (step, -step))
        found = predict_peak(door, (name,), np.eye(1), omega0, theta0)
        assert found.angle_std == pytest.approx(
            abs(high.angle - low.angle) / (2.0 * step), rel=1e-3, abs=1e-6)
        assert found.time_std == pytest.approx(
            abs(high.time - low.time) / (2.0 * step), rel=2e-3, abs=1e-5)


def test_a_common_factor_leaves_the_peak_alone() -> None:
    """An error of the scale, common to all four parameters, does not affect the peak."""
    values = np.array([getattr(PAPER, name) for name in PARAMETERS])
    found = predict_peak(PAPER, PARAMETERS, np.outer(values, values) * 0.05**2, 0.6)
    assert found.angle_std < 1e-9
    assert found.angle == peak(PAPER, 0.0, 0.6).angle
    assert found.interval() == pytest.approx((found.angle, found.angle))
    assert math.degrees(found.angle) > 20.0
