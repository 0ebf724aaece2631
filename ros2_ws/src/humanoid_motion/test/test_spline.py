"""The spline that a driver follows."""

import numpy as np
import pytest
from humanoid_motion.spline import Spline
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

VALUES = st.floats(-3.0, 3.0)


@st.composite
def knots(draw: st.DrawFn) -> tuple[np.ndarray, ...]:
    """Times of knots, and positions, velocities and accelerations there."""
    count = draw(st.integers(2, 6))
    steps = draw(arrays(float, count, elements=st.floats(0.01, 2.0)))
    q, v, a = (draw(arrays(float, (count, 3), elements=VALUES)) for _ in range(3))
    return np.cumsum(steps), q, v, a


@given(knots(), st.integers(1, 3))
def test_spline_passes_through_its_knots_with_their_derivatives(data, order) -> None:
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


@given(knots(), st.integers(1, 3))
def test_position_and_given_derivatives_are_continuous_at_inner_knots(data, order) -> None:
    """Just before and just after an inner knot the joints are in the same state."""
    times, *states = data
    spline = Spline(times, *states[:order])
    for time in times[1:-1]:
        before, after = spline.sample(float(time) - 1e-9), spline.sample(float(time) + 1e-9)
        np.testing.assert_allclose(before.position, after.position, atol=1e-4)
        if order > 1:
            np.testing.assert_allclose(before.velocity, after.velocity, atol=2e-3)


def test_quintic_reproduces_a_polynomial_of_degree_five() -> None:
    """Knots on a polynomial of degree five give this polynomial."""
    coefficients = np.array([0.3, -1.0, 0.5, 2.0, -1.5, 0.7])
    exact = np.polynomial.Polynomial(coefficients)
    times = np.array([0.2, 0.9, 1.4])
    spline = Spline(times, *(p(times)[:, None] for p in (exact, exact.deriv(), exact.deriv(2))))
    for time in np.linspace(0.2, 1.399, 23):
        assert spline.sample(time).position[0] == pytest.approx(exact(time), abs=1e-12)
        assert spline.sample(time).velocity[0] == pytest.approx(exact.deriv()(time), abs=1e-11)


def test_joints_rest_outside_the_knots() -> None:
    """Before the first knot and from the last knot on, nothing moves."""
    spline = Spline(np.array([1.0, 2.0]), np.array([[0.0], [1.0]]), np.array([[5.0], [5.0]]))
    for time, place in ((0.5, 0.0), (2.0, 1.0), (9.0, 1.0)):
        assert spline.sample(time).position[0] == place
        assert spline.sample(time).velocity[0] == 0.0
