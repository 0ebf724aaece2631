"""Splines through knots, the reduction of dense samples to knots, and joining of knots."""

import numpy as np
import pytest
from humanoid_motion.knots import TOLERANCE, Knots, from_samples
from humanoid_motion.splice import concatenate, cut, duration, slowed, without_first
from humanoid_motion.spline import Spline
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

VALUES = st.floats(-3.0, 3.0)


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


def test_cut_and_without_first_keep_the_motion():
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


@st.composite
def trajectories(draw):
    """Times of knots, and positions, velocities and accelerations there."""
    count = draw(st.integers(2, 6))
    steps = draw(arrays(float, count, elements=st.floats(0.01, 2.0)))
    q, v, a = (draw(arrays(float, (count, 3), elements=VALUES)) for _ in range(3))
    return np.cumsum(steps), q, v, a


@given(trajectories(), st.integers(1, 3))
def test_spline_passes_through_its_knots_with_their_derivatives(data, order):
    """At each knot, position and the given derivatives are those of the knot."""
    times, *states = data
    spline = Spline(times, *states[:order])
    for index, time in enumerate(times[:-1]):
        state = spline.sample(float(time))
        found = (state.position, state.velocity, state.acceleration)
        for wanted, got in zip(states[:order], found, strict=False):
            np.testing.assert_allclose(got, wanted[index], atol=1e-9)
    end = spline.end_state()
    np.testing.assert_allclose(end.position, states[0][-1], atol=1e-6)
    if order > 1:
        np.testing.assert_allclose(end.velocity, states[1][-1], atol=1e-5)
    if order > 2:
        np.testing.assert_allclose(end.acceleration, states[2][-1], atol=1e-3)


def test_joints_rest_outside_the_knots():
    """Before the first knot and from the last knot on, nothing moves."""
    spline = Spline(np.array([1.0, 2.0]), np.array([[0.0], [1.0]]), np.array([[5.0], [5.0]]))
    for time, place in ((0.5, 0.0), (2.0, 1.0), (9.0, 1.0)):
        assert spline.sample(time).position[0] == place
        assert spline.sample(time).velocity[0] == 0.0
