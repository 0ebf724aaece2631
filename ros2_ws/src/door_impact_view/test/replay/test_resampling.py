"""Which samples a replay keeps, and recorded values at other times."""

import numpy as np
from door_impact_view.replay.resampling import (
    at_stamps,
    between,
    choose_stamps,
    latest,
    poses_at_stamps,
)
from hypothesis import given
from hypothesis import strategies as st

steps = st.lists(st.floats(1e-4, 0.5), min_size=0, max_size=400)
moments = st.lists(st.floats(-1.0, 20.0), max_size=3)


@given(steps, moments)
def test_kept_stamps_are_recorded_ones_with_both_ends(steps, moments):
    """No time is invented, none is kept twice, and the first and the last one stay."""
    t = np.cumsum([3.0, *steps])
    kept = choose_stamps(t, moments)
    assert np.isin(kept, t).all()
    assert (np.diff(kept) > 0.0).all()
    assert (kept[0], kept[-1]) == (t[0], t[-1])


@given(st.floats(1.5, 8.0))
def test_every_millisecond_of_a_contact_is_kept_and_few_samples_elsewhere(contact):
    """All samples within 0.15 s of a contact, and some 25 a second far from it."""
    t = np.arange(0.0, 10.0, 1e-3)
    kept = choose_stamps(t, [contact])
    near = np.abs(t - contact) < 0.149
    assert np.isin(t[near], kept).all()
    far = np.abs(kept - contact) > 1.0
    assert 0.9 * 25.0 < far.sum() / (10.0 - 2.0) < 1.1 * 25.0


@given(steps.filter(len))
def test_interpolation_hits_the_samples_and_stays_at_the_ends(steps):
    """At sample times the values are the samples; outside they are those of the ends."""
    t = np.cumsum([1.0, *steps])
    values = np.column_stack([np.sin(t), t])
    np.testing.assert_allclose(at_stamps(t, values, t), values, atol=1e-12)
    np.testing.assert_allclose(at_stamps(t, values, np.array([-5.0, t[-1] + 5.0])),
                               values[[0, -1]])


def about_axis(angle):
    """Quaternions (n, 4) of turns about one axis by angles (n,) [rad]."""
    return np.cos(angle / 2.0)[:, None] * [1.0, 0.0, 0.0, 0.0] + np.sin(
        angle / 2.0)[:, None] * [0.0, 0.0, 0.6, 0.8]


@given(st.lists(st.sampled_from([-1.0, 1.0]), min_size=30, max_size=30))
def test_poses_do_not_depend_on_the_quaternions_signs(signs):
    """q and -q are the same orientation; between them a pose does not turn."""
    t = np.linspace(0.0, 1.0, 30)
    angle = np.linspace(-3.0, 3.0, 30)
    turns = about_axis(angle) * np.array(signs)[:, None]
    middle = 0.5 * (t[1:] + t[:-1])
    found = poses_at_stamps(t, np.hstack([np.zeros((30, 3)), turns]), middle)[:, 3:]
    true = about_axis(0.5 * (angle[1:] + angle[:-1]))
    np.testing.assert_allclose(np.abs(np.sum(found * true, axis=1)), 1.0, atol=1e-9)


def test_no_value_is_invented_in_a_gap():
    """Between samples that are near in time it is interpolated, elsewhere unknown."""
    t, values = np.array([1.0, 1.1, 3.0]), np.array([[10.0], [20.0], [30.0]])
    found = between(t, values, np.array([0.5, 0.95, 1.05, 2.0, 3.0, 3.05, 4.0]), longest=0.2)
    np.testing.assert_allclose(found[:, 0], [np.nan, 10.0, 15.0, np.nan, 30.0, 30.0, np.nan])


def test_a_value_that_is_too_old_is_unknown():
    """The last value before a time counts for a while, and none before the first."""
    t, values = np.array([1.0, 2.0]), np.array([[10.0], [20.0]])
    found = latest(t, values, np.array([0.5, 1.0, 1.4, 1.6, 2.2, 9.0]), longest=0.5)[:, 0]
    np.testing.assert_array_equal(found, [np.nan, 10.0, 10.0, np.nan, 20.0, np.nan])
