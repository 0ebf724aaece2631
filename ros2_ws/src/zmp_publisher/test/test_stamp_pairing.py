"""Pairing of samples of the same stamp."""

from hypothesis import given
from hypothesis import strategies as st
from zmp_publisher.stamp_pairing import StampPairer

STREAMS = ("a", "b", "c")


def _run(events):
    pairer = StampPairer(STREAMS)
    found = [pairer.add(stream, stamp, (stream, stamp)) for stream, stamp in events]
    return pairer, [together for together in found if together]


@given(st.lists(st.sampled_from(STREAMS), min_size=90, max_size=90))
def test_any_interleaving_within_the_buffers_gives_every_stamp_once_in_order(order):
    """However the three streams are interleaved, each stamp comes out once, in order."""
    ahead = {name: iter(range(30)) for name in STREAMS}
    events = [(name, stamp) for name in order if (stamp := next(ahead[name], None)) is not None]
    events += [(name, stamp) for name in STREAMS for stamp in ahead[name]]
    pairer, found = _run(events)
    assert [together["a"][1] for together in found] == list(range(30))
    assert all(together[name] == (name, together["a"][1]) for together in found for name in STREAMS)
    assert pairer.dropped == 0


def test_a_lost_sample_costs_only_its_own_stamp():
    """Where one stream lacks a stamp the others' samples of it are dropped and counted."""
    events = [(name, stamp) for stamp in range(5) for name in STREAMS if (name, stamp) != ("b", 2)]
    pairer, found = _run(events)
    assert [together["a"][1] for together in found] == [0, 1, 3, 4]
    assert pairer.dropped == 2


def test_nothing_is_paired_across_a_jump_backwards():
    """Samples buffered before a reset never meet samples from after it."""
    pairer = StampPairer(STREAMS)
    for stamp in (0, 5, 10):
        pairer.add("a", stamp, ("old", stamp))
    pairer.add("b", 10, ("old", 10))
    assert pairer.add("a", 0, ("new", 0)) is None
    assert pairer.add("c", 10, ("old", 10)) is None
    assert pairer.add("b", 0, ("new", 0)) is None
    together = pairer.add("c", 0, ("new", 0))
    assert set(together.values()) == {("new", 0)}


def test_buffers_are_bounded():
    """A stream whose partners are missing keeps at most `capacity` samples."""
    pairer = StampPairer(STREAMS, capacity=10)
    for stamp in range(1000):
        assert pairer.add("a", stamp, stamp) is None
    assert pairer.dropped == 990
