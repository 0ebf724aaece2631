"""Reduction of dense samples to knots."""

import numpy as np
import pytest
from humanoid_motion.knots import TOLERANCE, Knots, from_samples
from hypothesis import given
from hypothesis import strategies as st


def sines(frequencies, n=301, duration=1.5):
    """Sampled sines with their derivatives, one column for each frequency [Hz]."""
    time = np.linspace(0.0, duration, n)
    w = 2.0 * np.pi * np.asarray(frequencies)
    phase = time[:, None] * w
    return time, 0.3 * np.sin(phase), 0.3 * w * np.cos(phase), -0.3 * w**2 * np.sin(phase)


@given(st.lists(st.floats(0.05, 2.0), min_size=1, max_size=5), st.sampled_from([2e-4, 2e-5, 1e-6]))
def test_spline_stays_within_the_tolerance_of_every_sample(frequencies, tolerance):
    """The error at every sample and joint is within the tolerance; first and last are knots."""
    samples = sines(frequencies)
    knots, index = from_samples(*samples, tolerance=tolerance)
    position, _, _ = knots.at(samples[0])
    assert np.max(np.abs(position - samples[1])) <= tolerance * (1.0 + 1e-9)
    assert index[0] == 0
    assert index[-1] == len(samples[0]) - 1


def test_few_knots_do_for_a_smooth_motion():
    """A slow sine of 301 samples needs less than a tenth of them."""
    knots, _ = from_samples(*sines([0.5]))
    assert len(knots.time) < 30


def test_a_quintic_needs_two_knots():
    """A polynomial of the spline's own degree is kept exactly."""
    time = np.linspace(0.0, 1.0, 101)
    polynomial = np.polynomial.Polynomial([0.1, -0.4, 1.0, 2.0, -3.0, 0.7])
    knots, _ = from_samples(
        time,
        polynomial(time)[:, None],
        polynomial.deriv(1)(time)[:, None],
        polynomial.deriv(2)(time)[:, None],
        tolerance=1e-9,
    )
    assert len(knots.time) == 2
    middle = 0.37
    position, velocity, acceleration = knots.at(middle)
    assert position[0, 0] == pytest.approx(polynomial(middle))
    assert velocity[0, 0] == pytest.approx(polynomial.deriv(1)(middle))
    assert acceleration[0, 0] == pytest.approx(polynomial.deriv(2)(middle))


def test_a_jump_between_samples_makes_a_knot_there():
    """A velocity that jumps is not smoothed away."""
    time = np.linspace(0.0, 1.0, 101)
    late = np.maximum(time - 0.5, 0.0)[:, None]
    knots, _ = from_samples(time, late, (late > 0.0).astype(float), np.zeros((101, 1)))
    assert np.min(np.abs(knots.time - 0.5)) < 0.011
    assert np.max(np.abs(knots.at(time)[0] - late)) <= TOLERANCE


def test_times_outside_are_held_at_the_ends():
    """Before the first and after the last knot the position stays."""
    knots, _ = from_samples(*sines([0.5]))
    np.testing.assert_array_equal(knots.at([-1.0, 99.0])[0], knots.at([0.0, 1.5])[0])


def test_times_must_rise():
    """Repeated times are refused."""
    table = np.zeros((2, 2))
    with pytest.raises(ValueError, match="rising"):
        Knots(np.zeros(2), table, table, table)
