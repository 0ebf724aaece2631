"""MCV50 against its published figures, and the run-up along its first half."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.motion.cam_curve import (
    PEAK_ACCELERATION,
    PEAK_JERK,
    PEAK_VELOCITY,
    CamRunUp,
    mcv50,
)

T = np.linspace(0.0, 1.0, 20001)


def test_peaks_are_the_published_ones():
    """Vm, Am and jerk are those that tables print for cam curve no. 27."""
    assert pytest.approx(1.275258, abs=1e-6) == PEAK_VELOCITY
    assert pytest.approx(8.012683, abs=1e-6) == PEAK_ACCELERATION
    assert pytest.approx(201.3807, abs=1e-4) == PEAK_JERK
    cam = mcv50(T)
    assert np.max(cam.v) == pytest.approx(PEAK_VELOCITY, rel=1e-12)
    assert np.max(np.abs(cam.a)) == pytest.approx(PEAK_ACCELERATION, rel=1e-6)
    assert np.max(np.abs(cam.a * cam.v)) == pytest.approx(5.7334, abs=1e-4)
    table = np.diff(mcv50(np.linspace(0.0, 1.0, 721)).a) * 720.0  # by finite differences
    assert (table.max(), table.min()) == pytest.approx((201.33981, -67.12538), abs=1e-4)


def test_break_points():
    """Displacement and velocity are right at the break points and outside the curve."""
    found = mcv50(np.array([-0.5, 0.0, 0.0625, 0.25, 0.5, 0.75, 0.9375, 1.0, 1.5]))
    peak = 1.275258
    np.testing.assert_allclose(
        found.s, [0.0, 0.0, 0.007241, 0.181185, 0.5, 0.818815, 0.992759, 1.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(
        found.v, [0.0, 0.0, 0.318815, peak, peak, peak, 0.318815, 0.0, 0.0], atol=1e-6)


def test_each_derivative_is_the_slope_of_the_one_before():
    """v and a are the numerical slopes of s and v, also across break points."""
    cam = mcv50(T)
    np.testing.assert_allclose(np.gradient(cam.s, T)[1:-1], cam.v[1:-1], atol=2e-4)
    np.testing.assert_allclose(np.gradient(cam.v, T)[1:-1], cam.a[1:-1], atol=2e-2)


speeds = st.floats(0.05, 1.5)
distances = st.floats(0.05, 1.0)


@given(speeds, distances)
def test_run_up_meets_the_contact_at_its_speed_and_distance(speed, distance):
    """At half the cam's time the CoM has its distance and its speed, and keeps the speed."""
    law = CamRunUp(speed, distance)
    at = law.at([law.duration, law.duration + 0.1])
    assert at.s[0] == pytest.approx(distance, rel=1e-9)
    np.testing.assert_allclose(at.v, speed, rtol=1e-9)
    assert at.s[1] == pytest.approx(distance + 0.1 * speed, rel=1e-9)
    np.testing.assert_allclose(at.a, 0.0, atol=1e-9)


@given(speeds, distances)
def test_run_up_never_turns_back_and_peaks_as_stated(speed, distance):
    """The speed never falls, and the largest acceleration is 2.464 v^2 / d."""
    law = CamRunUp(speed, distance)
    course = law.at(np.linspace(-0.1, law.duration + 0.2, 4001))
    assert np.all(np.diff(course.v) >= -1e-12)
    assert np.max(course.a) == pytest.approx(2.4635 * speed**2 / distance, rel=1e-3)
