"""Conversion of stamps to numbers and back."""

import pytest
from builtin_interfaces.msg import Duration, Time
from door_impact_common.stamps import nanoseconds, seconds, stamp_of
from hypothesis import given
from hypothesis import strategies as st

TIMES = st.integers(0, 2**31 * 10**9 - 1)  # what the message can hold [ns]


@given(TIMES)
def test_nanoseconds_undo_stamp_of(time):
    """Every time that a message can hold comes back to the nanosecond."""
    stamp = stamp_of(time)
    assert nanoseconds(stamp) == time
    assert 0 <= stamp.nanosec < 10**9


@given(TIMES)
def test_seconds_are_within_half_a_microsecond(time):
    """A float keeps every time that a message can hold to half a microsecond."""
    assert seconds(stamp_of(time)) == pytest.approx(1e-9 * time, rel=0.0, abs=5e-7)


@given(st.integers(-(2**31), 2**31 - 1), st.integers(0, 10**9 - 1))
def test_durations_may_be_negative(whole, rest):
    """A negative duration has negative seconds and nanoseconds that count forwards."""
    duration = Duration(sec=whole, nanosec=rest)
    assert nanoseconds(duration) == whole * 10**9 + rest
    assert seconds(duration) == pytest.approx(whole + 1e-9 * rest, rel=0.0, abs=5e-7)


def test_stamps_compare_as_their_nanoseconds():
    """One nanosecond before a full second."""
    assert nanoseconds(Time(sec=2, nanosec=0)) - nanoseconds(Time(sec=1, nanosec=999_999_999)) == 1
