"""The decoder: gaps, late and bad batches, zero, restarts."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from door_encoder.decoding.angle import AngleSampler
from door_encoder.decoding.decoder import EncoderDecoder, assess
from door_encoder.decoding.settings import Settings
from door_encoder.errors import BadBatchError
from door_model.recording.batch import SampleBatch
from hypothesis import given
from hypothesis import strategies as st


def batch(first: int, values: Sequence[int], **changes: Any) -> SampleBatch:
    """Return a batch at 1 kHz whose stamp follows from its number."""
    return replace(SampleBatch(10**9 + first * 10**6, 1e-3, first, 14400, values), **changes)


def decode(decoder: EncoderDecoder, batch: SampleBatch) -> SampleBatch | None:
    """Decode a batch without jumps to one batch or to nothing."""
    pieces = decoder.decode(batch)
    assert len(pieces) <= 1
    return pieces[0] if pieces else None


def started() -> EncoderDecoder:
    """Return a decoder whose zero is known: the door stood at 1000 counts."""
    decoder = EncoderDecoder()
    assert decode(decoder, batch(0, [1000] * 20)) is not None
    return decoder


@given(sizes=st.lists(st.integers(1, 50), min_size=2, max_size=20),
       modulus=st.sampled_from([256, 2**16, 2**32]), offset=st.integers(0, 2**16),
       direction=st.sampled_from([1, -1]))
def test_any_cut_of_the_stream_decodes_alike(
        sizes: list[int], modulus: int, offset: int, direction: int) -> None:
    """Batches of any size, with any zero, width and direction, decode to the counts of the door."""
    total = sum(sizes) + 20
    truth = np.concatenate([np.zeros(20, int), np.cumsum(np.arange(total - 20) % 5)])
    raw = (direction * truth + offset) % modulus
    decoder = EncoderDecoder(Settings(modulus=modulus, direction=direction))
    found, first = [], 0
    for size in (20, *sizes):
        found.append(decode(decoder, batch(first, raw[first : first + size])))
        first += size
    counts = np.concatenate([part.counts for part in found if part is not None])
    np.testing.assert_array_equal(counts, truth)
    assert not any(part.gap_before for part in found if part is not None)
    assert decoder.health["lost"] == decoder.health["gaps"] == decoder.health["late"] == 0


@pytest.mark.parametrize(("made", "lost"), [
    (batch(60, [1030] * 20), 40),
    (batch(20, [1030] * 20, stamp_ns=10**9 + 70 * 10**6), 0),
    (batch(20, [1030] * 20, gap_before=True), 0),
], ids=["number", "stamp", "the sender's word"])  # fmt: skip
def test_what_is_missing_is_a_gap(made: SampleBatch, lost: int) -> None:
    """A gap is marked, the lost samples are counted, and the counts go on."""
    decoder = started()
    decoded = decode(decoder, made)
    assert decoded is not None
    assert decoded.gap_before
    assert (decoded.counts == 30).all()
    assert (decoder.health["gaps"], decoder.health["lost"]) == (1, lost)


def test_what_was_received_before_is_dropped() -> None:
    """Late and duplicate batches give nothing, and one that overlaps its new half."""
    decoder = started()
    assert decode(decoder, batch(20, [1001] * 20)) is not None
    assert decode(decoder, batch(20, [1001] * 20)) is None
    assert decode(decoder, batch(0, [1000] * 20)) is None
    assert decoder.health["late"] == 2
    after = decode(decoder, batch(30, [1001] * 10 + [1005] * 10))
    assert after is not None
    assert not after.gap_before
    assert (after.first_index, after.stamp_ns) == (40, 10**9 + 40 * 10**6)
    assert after.counts.tolist() == [5] * 10


@pytest.mark.parametrize("changes", [
    {"period": 0.0}, {"period": math.nan}, {"first_index": 2**64 - 1}, {"counts_per_turn": 3600},
    {"counts": []}])
def test_bad_batches_are_refused_and_nothing_is_lost(changes: dict[str, Any]) -> None:
    """A bad batch among good ones only increases the number of refused batches."""
    decoder = started()
    with pytest.raises(BadBatchError):
        decode(decoder, batch(20, [5] * 20, **changes))
    decoded = decode(decoder, batch(20, [1003] * 20))
    assert decoded is not None
    assert not decoded.gap_before
    assert (decoded.counts == 3).all()
    assert decoder.health["refused"] == 1


def test_zero_waits_for_a_still_door() -> None:
    """A door that moves at the start is zeroed only after it has come to rest."""
    decoder = EncoderDecoder()
    assert decode(decoder, batch(0, list(range(0, 100, 5)))) is None
    decoded = decode(decoder, batch(20, [100] * 30))
    assert decoded is not None
    assert (decoded.counts == 0).all()


def test_zero_from_a_parameter() -> None:
    """A configured zero works at once, also across the wrap of the counter."""
    decoded = decode(EncoderDecoder(Settings(modulus=2**16, zero=65530)), batch(0, [2, 4]))
    assert decoded is not None
    assert decoded.counts.tolist() == [8, 10]


@pytest.mark.parametrize(
    "changes", [{"stamp_ns": 10**10}, {"stamp_ns": 0}, {"gap_before": True}])
def test_a_sender_that_begins_anew_is_zeroed_anew(changes: dict[str, Any]) -> None:
    """Numbers begin again, and the time goes on or far back, or the sender says so by a gap.

    The counter had gained counts, which were subtracted; the new start does not inherit them.
    """
    decoder = started()
    for first in range(20, 2000, 20):
        decode(decoder, batch(first, [1000 if first < 200 else 5000] * 20))
    assert decoder.offset == 4000
    decoded = decode(decoder, batch(0, [7] * 20, **changes))
    assert decoded is not None
    assert decoded.gap_before
    assert (decoded.counts == 0).all()
    assert (decoder.health["restarts"], decoder.offset, decoder.zero_in_doubt) == (1, 0, False)


INT64 = st.integers(-(2**63), 2**63 - 1)


@given(
    batches=st.lists(
        st.builds(
            SampleBatch, stamp_ns=st.integers(0, 3 * 10**9) | st.integers(-(2**61), 2**61),
            period=st.sampled_from([1e-3, 1e-4, 1.0]) | st.floats(),
            first_index=st.integers(0, 100) | st.integers(0, 2**64 - 1),
            counts_per_turn=st.sampled_from([14400, 14400, 0]),
            counts=st.lists(INT64 | st.integers(-5, 5), max_size=30), gap_before=st.booleans(),
            index_counts=st.lists(INT64 | st.integers(-5, 5), max_size=2)),
        max_size=12,
    ),
    modulus=st.sampled_from([0, 2, 2**16, 2**32, 2**62]),
    zero=st.none() | st.integers(-(2**61), 2**61),
)
def test_no_message_can_end_the_decoder(
    batches: list[SampleBatch], modulus: int, zero: int | None
) -> None:
    """A batch with any fields is refused, dropped, or decoded to values that fit into a message."""
    decoder = EncoderDecoder(Settings(modulus=modulus, zero=zero))
    sampler = AngleSampler(radians_per_count=1e-3)
    for made in batches:
        try:
            pieces = decoder.decode(made)
        except BadBatchError:
            continue
        for piece in pieces:
            assert len(piece.counts)
            assert piece.counts.dtype == np.int64
            assert 0 <= piece.first_index < 2**64 - len(piece.counts)
            for point in sampler.take(piece):
                assert math.isfinite(point.theta)
                assert math.isfinite(point.omega)
        assess(decoder, 0.0, {})
