"""Preview control of the cart on a table."""

import numpy as np
from door_impact_common.constants import GRAVITY
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from walking.pattern.preview import CartState, preview_control

HEIGHT = 0.78
CONTROL = preview_control(0.02, HEIGHT, 2.0, 1e-6)
STEPS = arrays(float, (8, 2), elements=st.floats(-0.3, 0.3))


def reference_of(places):
    """Return a reference that stays at each place for 0.7 s and goes to the next one in 0.1 s."""
    times = np.ravel([[0.8 * n, 0.8 * n + 0.7] for n in range(len(places))])
    grid = np.arange(0.0, times[-1] + 1e-9, 0.02)
    return np.column_stack([np.interp(grid, times, np.repeat(c, 2)) for c in places.T])


def zmp_of(course):
    return course.com[:, 0] - HEIGHT / GRAVITY * course.com[:, 2]


@given(STEPS)
def test_the_carts_zmp_stays_within_a_few_millimetres_of_its_reference(places):
    """The error is at most 5 % of the largest distance between two places."""
    places[0] = 0.0
    places[1] = 0.0  # known 0.8 s before the first step, as in a walk
    reference = reference_of(places)
    course = CONTROL.follow(CartState.at_rest(np.zeros(2)), reference)
    largest = max(np.abs(np.diff(places, axis=0)).max(), 1e-6)
    assert np.abs(zmp_of(course) - reference).max() < 0.05 * largest + 0.03 * 0.3


def test_a_cart_at_rest_stays_at_rest_wherever_it_is():
    """The truncated horizon does not draw the CoM to the origin."""
    place = np.array([30.0, -20.0])
    course = CONTROL.follow(CartState.at_rest(place), np.tile(place, (500, 1)))
    np.testing.assert_allclose(course.com[-1], np.vstack([place, np.zeros((2, 2))]), atol=1e-9)


@given(STEPS, st.integers(1, 200))
def test_a_course_that_is_begun_anew_on_the_way_continues(places, sample):
    """From any state of a course the same reference gives the same course."""
    reference = reference_of(places)
    whole = CONTROL.follow(CartState.at_rest(reference[0]), reference)
    rest = CONTROL.follow(whole.state(sample), reference[sample:])
    np.testing.assert_allclose(rest.com, whole.com[sample:], atol=1e-9)
    np.testing.assert_allclose(rest.jerk, whole.jerk[sample:], atol=1e-7)


def test_another_future_changes_the_zmp_no_more_than_it_must():
    """A step that is left out 0.8 s ahead costs less ZMP than a tenth of the step."""
    going, stopping = (reference_of(np.array([[0.2 * min(n, last), 0.0] for n in range(9)]))
                       for last in (9, 5))
    state = CONTROL.follow(CartState.at_rest(np.zeros(2)), going).state(160)
    course = CONTROL.follow(state, stopping[160:])
    assert np.abs(zmp_of(course) - stopping[160:]).max() < 0.02
    np.testing.assert_array_equal(course.com[0], state.com)
