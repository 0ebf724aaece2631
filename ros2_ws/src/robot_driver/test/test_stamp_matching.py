"""Matching of messages by their stamps."""

from hypothesis import given
from hypothesis import strategies as st
from robot_driver.stamp_matching import ImuMatcher, StampPairer

PATIENCE = 50
STREAMS = ("a", "b", "c")


def _run(events):
    pairer = StampPairer(STREAMS)
    found = [pairer.add(stream, stamp, (stream, stamp)) for stream, stamp in events]
    return pairer, list(filter(None, found))


@given(st.lists(st.sampled_from(STREAMS), min_size=90, max_size=90),
       st.lists(st.floats(-0.0012, 0.0012), min_size=90, max_size=90))
def test_any_interleaving_within_the_buffers_gives_every_period_once_in_order(order, errors):
    """Stamps of one period of 5 ms may differ by up to 2.4 ms, as those of broadcasters do."""
    stamps = {name: [0.005 * k + errors[30 * n + k] for k in range(30)]
              for n, name in enumerate(STREAMS)}
    ahead = {name: iter(times) for name, times in stamps.items()}
    events = [(name, stamp) for name in order if (stamp := next(ahead[name], None)) is not None]
    events += [(name, stamp) for name in STREAMS for stamp in ahead[name]]
    pairer, found = _run(events)
    assert [stamp for stamp, _ in found] == stamps["a"]
    assert [[together[name][1] for name in STREAMS] for _, together in found] == list(
        map(list, zip(*stamps.values(), strict=True)))
    assert pairer.dropped == 0


def test_a_lost_sample_costs_only_its_own_stamp():
    """Where one stream lacks a stamp the others' samples of it are dropped and counted."""
    events = [(name, stamp) for stamp in range(5) for name in STREAMS if (name, stamp) != ("b", 2)]
    pairer, found = _run(events)
    assert [stamp for stamp, _ in found] == [0, 1, 3, 4]
    assert pairer.dropped == 2


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
    matcher = ImuMatcher(PATIENCE)
    add = {"sample": matcher.add_sample, "reading": matcher.add_reading}
    found = [match for kind, stamp in events for match in add[kind](stamp, (kind, stamp))]
    assert [stamp for stamp, _, _ in found] == samples[: len(found)]
    assert [sample for _, sample, _ in found] == [("sample", stamp) for stamp in samples][
        : len(found)]
    # Those that wait are newer than every reading.
    assert all(stamp > readings[-1] for stamp in samples[len(found) :])
    for stamp, _, reading in found:
        nearest = min(abs(other - stamp) for other in readings)
        assert reading is not None
        assert abs(reading[1] - stamp) <= max(nearest, period)


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
