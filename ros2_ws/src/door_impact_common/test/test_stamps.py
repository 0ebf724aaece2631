"""Conversion of stamps to numbers and back."""

import pytest
from builtin_interfaces.msg import Duration
from door_impact_common.stamps import nanoseconds, seconds, stamp_of
from hypothesis import given
from hypothesis import strategies as st

TIMES = st.integers(0, 2**31 * 10**9 - 1)  # what the message can hold [ns]


@given(TIMES)
def test_every_time_comes_back_to_the_nanosecond_and_as_seconds_to_half_a_microsecond(time):
    stamp = stamp_of(time)
    assert nanoseconds(stamp) == time
    assert 0 <= stamp.nanosec < 10**9
    assert seconds(stamp) == pytest.approx(1e-9 * time, rel=0.0, abs=5e-7)


@given(st.integers(-(2**31), 2**31 - 1), st.integers(0, 10**9 - 1))
def test_a_negative_duration_has_nanoseconds_that_count_forwards(whole, rest):
    duration = Duration(sec=whole, nanosec=rest)
    assert nanoseconds(duration) == whole * 10**9 + rest
    assert seconds(duration) == pytest.approx(whole + 1e-9 * rest, rel=0.0, abs=5e-7)
