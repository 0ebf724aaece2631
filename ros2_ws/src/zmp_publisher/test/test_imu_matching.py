"""Matching of samples with readings of an IMU."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from zmp_publisher.imu_matching import ImuMatcher

PATIENCE = 50


def _play(matcher, events):
    found = []
    for kind, stamp in events:
        add = matcher.add_sample if kind == "sample" else matcher.add_reading
        found += add(stamp, (kind, stamp))
    return found


@given(st.lists(st.booleans(), min_size=80, max_size=80), st.integers(1, 12), st.integers(0, 11))
def test_any_interleaving_gives_each_sample_the_nearest_reading(order, period, offset):
    """Whatever the IMU's rate, phase and delay: each sample once, in order, with its reading."""
    ahead = {"sample": iter(range(100, 300, 5)), "reading": iter(range(100 + offset, 320, period))}
    # The IMU speaks first: an IMU that was never heard is not waited for.
    events = [("reading", next(ahead["reading"]))]
    lag = {"sample": 100, "reading": events[0][1]}
    for is_sample in order:
        kind = "sample" if is_sample else "reading"
        if lag[kind] - min(lag.values()) < PATIENCE - 12:  # no stream is ahead by the patience
            stamp = next(ahead[kind], None)
            if stamp is not None:
                events.append((kind, stamp))
                lag[kind] = stamp
    samples = [stamp for kind, stamp in events if kind == "sample"]
    readings = [stamp for kind, stamp in events if kind == "reading"]
    found = _play(ImuMatcher(PATIENCE), events)
    assert [stamp for stamp, _, _ in found] == samples[: len(found)]
    assert [sample for _, sample, _ in found] == [("sample", stamp) for stamp in samples][
        : len(found)]
    # Those that wait are newer than every reading.
    assert all(stamp > readings[-1] for stamp in samples[len(found) :])
    for stamp, _, reading in found:
        nearest = min(abs(other - stamp) for other in readings)
        assert reading is not None
        assert abs(reading[1] - stamp) <= max(nearest, period)


def test_readings_of_the_same_stamp_are_taken():
    """Where a driver stamps all messages of a tick alike, sample and reading are of one tick."""
    events = [(kind, stamp) for stamp in range(0, 500, 5) for kind in ("sample", "reading")]
    found = _play(ImuMatcher(PATIENCE), events)
    assert [stamp for stamp, _, _ in found] == list(range(0, 500, 5))
    assert all(reading == ("reading", stamp) for stamp, _, reading in found[1:])
    assert found[0][2] is None  # the first sample came before the IMU was heard


def test_without_an_imu_nothing_waits():
    """Each sample comes out at once, without a reading."""
    matcher = ImuMatcher(PATIENCE)
    for stamp in range(0, 500, 5):
        assert matcher.add_sample(stamp, "sample") == [(stamp, "sample", None)]


def test_an_imu_that_falls_silent_holds_samples_for_the_patience_only():
    """After that, those that waited come out in order, and later ones at once."""
    matcher = ImuMatcher(PATIENCE)
    matcher.add_reading(100, "reading")
    assert matcher.add_sample(100, "sample") == [(100, "sample", "reading")]
    waiting = [matcher.add_sample(stamp, "sample") for stamp in range(105, 155, 5)]
    assert not any(waiting)
    late = matcher.add_sample(155, "sample")
    assert [stamp for stamp, _, _ in late] == list(range(105, 160, 5))
    assert late[-1] == (155, "sample", None)
    assert matcher.add_sample(160, "sample") == [(160, "sample", None)]
    assert matcher.add_reading(165, "reading") == []
    assert matcher.add_sample(165, "sample") == [(165, "sample", "reading")]


@pytest.mark.parametrize("first", ["sample", "reading"])
def test_nothing_is_matched_across_a_jump_backwards(first):
    """After a reset no sample from before comes out, and no reading from before is used."""
    matcher = ImuMatcher(PATIENCE)
    _play(matcher, [("reading", 40), ("sample", 45)])  # the sample waits
    after = [(first, 0), ("reading" if first == "sample" else "sample", 0)]
    found = _play(matcher, [*after, ("reading", 5), ("sample", 5)])
    assert [(stamp, sample) for stamp, sample, _ in found] == [
        (0, ("sample", 0)), (5, ("sample", 5))]
    assert {reading for _, _, reading in found} <= {None, ("reading", 0), ("reading", 5)}
    assert found[-1][2] == ("reading", 5)
