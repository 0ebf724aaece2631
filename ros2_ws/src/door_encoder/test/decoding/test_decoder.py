"""The decoder: gaps, late and bad batches, zero, restarts; angles at a lower rate; health."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from door_encoder.decoding.angle import AngleSampler
from door_encoder.decoding.decoder import EncoderDecoder
from door_encoder.decoding.report import assess
from door_encoder.decoding.settings import Settings
from door_encoder.errors import BadBatchError
from door_impact_common.errors import SettingError
from door_model.recording.batch import SampleBatch
from door_model.recording.counts import wrap
from hypothesis import given
from hypothesis import strategies as st

PERIOD = 1e-3


def batch(first: int, values: Sequence[int], **changes: object) -> SampleBatch:
    """Return a batch at 1 kHz whose stamp follows from its number."""
    made = SampleBatch(
        stamp_ns=10**9 + first * 10**6,
        period=PERIOD,
        first_index=first,
        counts_per_turn=14400,
        counts=values,
    )
    return replace(made, **changes)  # type: ignore[arg-type]


def decode(decoder: EncoderDecoder, batch: SampleBatch) -> SampleBatch | None:
    """Decode a batch without jumps to one batch or to nothing."""
    pieces = decoder.decode(batch)
    assert len(pieces) <= 1
    return pieces[0] if pieces else None


def started(**changes: object) -> EncoderDecoder:
    """Return a decoder whose zero is known: the door stood at 1000 counts."""
    decoder = EncoderDecoder(replace(Settings(), **changes))  # type: ignore[arg-type]
    assert decode(decoder, batch(0, [1000] * 20)) is not None
    return decoder


@given(
    sizes=st.lists(st.integers(1, 50), min_size=2, max_size=20),
    modulus=st.sampled_from([256, 2**16, 2**32]),
    offset=st.integers(0, 2**16),
    direction=st.sampled_from([1, -1]),
)
def test_any_cut_of_the_stream_decodes_alike(
    sizes: list[int], modulus: int, offset: int, direction: int
) -> None:
    """Batches of any size, with any zero, width and direction, decode to the counts of the door."""
    total = sum(sizes) + 20
    truth = np.concatenate([np.zeros(20, int), np.cumsum(np.arange(total - 20) % 5)])
    raw = wrap(direction * truth + offset, modulus)
    decoder = EncoderDecoder(Settings(modulus=modulus, direction=direction))
    found = [decode(decoder, batch(0, raw[:20]))]
    first = 20
    for size in sizes:
        found.append(decode(decoder, batch(first, raw[first : first + size])))
        first += size
    counts = np.concatenate([part.counts for part in found if part is not None])
    np.testing.assert_array_equal(counts, truth)
    assert not any(part.gap_before for part in found if part is not None)
    assert decoder.health.lost == decoder.health.gaps == decoder.health.late == 0


def test_gap_by_number_counts_the_lost_samples() -> None:
    """With 40 samples missing there is one gap, 40 are counted as lost, and the counts go on."""
    decoder = started()
    decoded = decode(decoder, batch(60, [1030] * 20))
    assert decoded is not None
    assert decoded.gap_before
    assert (decoded.counts == 30).all()
    assert (decoder.health.gaps, decoder.health.lost) == (1, 40)


def test_gap_by_stamp_and_by_the_senders_word() -> None:
    """There is a gap if 50 ms are missing in the stamps, or if the sender sets gap_before."""
    decoder = started()
    late = batch(20, [1000] * 20)
    decoded = decode(decoder, replace(late, stamp_ns=late.stamp_ns + 50_000_000))
    assert decoded is not None
    assert decoded.gap_before
    told = decode(started(), batch(20, [1000] * 20, gap_before=True))
    assert told is not None
    assert told.gap_before


def test_late_and_duplicate_batches_are_dropped() -> None:
    """Late and duplicate batches give no output and do not disturb later batches."""
    decoder = started()
    assert decode(decoder, batch(20, [1001] * 20)) is not None
    assert decode(decoder, batch(20, [1001] * 20)) is None
    assert decode(decoder, batch(0, [1000] * 20)) is None
    assert decoder.health.late == 2
    after = decode(decoder, batch(40, [1002] * 20))
    assert after is not None
    assert not after.gap_before
    assert (after.counts == 2).all()


def test_overlap_is_cut_off() -> None:
    """A batch that repeats half of the previous one gives its new half with the right stamp."""
    decoded = decode(started(), batch(10, [1000] * 10 + [1005] * 10))
    assert decoded is not None
    assert decoded.first_index == 20
    assert decoded.stamp_ns == 10**9 + 20 * 10**6
    assert decoded.counts.tolist() == [5] * 10


@pytest.mark.parametrize(
    "changes",
    [
        {"period": 0.0},
        {"period": math.nan},
        {"first_index": 2**64 - 1},
        {"counts_per_turn": 3600},
        {"counts": []},
    ],
)
def test_bad_batches_are_refused_and_nothing_is_lost(changes: dict[str, object]) -> None:
    """A bad batch among good ones only increases the number of refused batches."""
    decoder = started()
    with pytest.raises(BadBatchError) as caught:
        decode(decoder, replace(batch(20, [5] * 20), **changes))  # type: ignore[arg-type]
    assert caught.value.limit is not None
    decoded = decode(decoder, batch(20, [1003] * 20))
    assert decoded is not None
    assert not decoded.gap_before
    assert (decoded.counts == 3).all()
    assert decoder.health.refused == 1


def test_zero_waits_for_a_still_door() -> None:
    """A door that moves at the start is zeroed only after it has come to rest."""
    decoder = EncoderDecoder()
    assert decode(decoder, batch(0, list(range(0, 100, 5)))) is None
    decoded = decode(decoder, batch(20, [100] * 30))
    assert decoded is not None
    assert (decoded.counts == 0).all()


def test_zero_from_a_parameter() -> None:
    """A configured zero works at once, also across the wrap of the counter."""
    decoder = EncoderDecoder(Settings(modulus=2**16, zero=65530))
    decoded = decode(decoder, batch(0, [2, 4]))
    assert decoded is not None
    assert decoded.counts.tolist() == [8, 10]


@pytest.mark.parametrize("stamp_ns", [10**10, 0])
def test_a_sender_that_begins_anew_is_zeroed_anew(stamp_ns: int) -> None:
    """If numbers begin again at 0, there is a gap and a new zero, but no jump."""
    decoder = started()
    for first in range(20, 2000, 20):
        decode(decoder, batch(first, [1000] * 20))
    decoded = decode(decoder, batch(0, [7] * 20, stamp_ns=stamp_ns))
    assert decoded is not None
    assert decoded.gap_before
    assert (decoded.counts == 0).all()
    assert (decoder.health.restarts, decoder.health.jumps) == (1, 0)


def test_a_sender_that_says_so_begins_anew_at_any_time() -> None:
    """Number 0 behind a gap is a new start, even where the clock went back by less than a second.

    The counter had gained counts, which were subtracted; the new start does not inherit them.
    """
    decoder = started()
    for first in range(20, 400, 20):
        decode(decoder, batch(first, [1000 if first < 200 else 5000] * 20))
    assert decoder.offset == 4000
    decoded = decode(decoder, batch(0, [1000] * 20, gap_before=True))
    assert decoded is not None
    assert (decoded.counts == 0).all()
    assert (decoder.health.restarts, decoder.offset, decoder.zero_in_doubt) == (1, 0, False)
    decoded = decode(decoder, batch(20, [1040] * 20))
    assert decoded is None or (decoded.counts == 40).all()


INT64 = st.integers(-(2**63), 2**63 - 1)


@given(
    batches=st.lists(
        st.builds(
            SampleBatch,
            stamp_ns=st.integers(0, 3 * 10**9) | st.integers(-(2**61), 2**61),
            period=st.sampled_from([1e-3, 1e-4, 1.0]) | st.floats(),
            first_index=st.integers(0, 100) | st.integers(0, 2**64 - 1),
            counts_per_turn=st.sampled_from([14400, 14400, 0]),
            counts=st.lists(INT64 | st.integers(-5, 5), max_size=30),
            gap_before=st.booleans(),
            index_counts=st.lists(INT64 | st.integers(-5, 5), max_size=2),
        ),
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


@pytest.mark.parametrize(
    "changes",
    [
        {"counts_per_turn": 0},
        {"max_speed": math.nan},
    ],
)
def test_settings_that_make_no_sense(changes: dict[str, object]) -> None:
    """Settings out of range are refused by the constructor."""
    with pytest.raises(SettingError):
        Settings(**changes)  # type: ignore[arg-type]


@given(sizes=st.lists(st.integers(1, 70), min_size=1, max_size=15))
def test_angle_comes_at_100_hz_whatever_the_batches(sizes: list[int]) -> None:
    """Every tenth sample gives a point with its stamp, its angle and the slope up to it."""
    sampler = AngleSampler(radians_per_count=1e-3)
    points, first = [], 0
    for size in sizes:
        counts = np.arange(first, first + size)
        made = SampleBatch(10**9 + first * 10**6, PERIOD, first, 14400, counts, False)
        points += list(sampler.take(made))
        first += size
    assert [point.stamp_ns for point in points] == [
        10**9 + index * 10**6 for index in range(0, sum(sizes), 10)
    ]
    for point in points:
        index = (point.stamp_ns - 10**9) // 10**6
        assert point.theta == pytest.approx(index * 1e-3)
        assert point.omega == pytest.approx(1.0 if index else 0.0)


@given(missing=st.integers(1, 10), speed=st.sampled_from([0, 1, 5]))
def test_velocity_goes_on_across_a_few_lost_samples(missing: int, speed: int) -> None:
    """A missed poll or a single garbage sample does not change the velocity of a steady door."""
    sampler = AngleSampler(radians_per_count=1e-3)
    counts = speed * np.arange(300)
    first = 100 + missing
    points = list(sampler.take(SampleBatch(0, PERIOD, 0, 14400, counts[:100], False)))
    points += sampler.take(SampleBatch(first * 10**6, PERIOD, first, 14400, counts[first:], True))
    assert all(point.omega == pytest.approx(speed) for point in points[1:])
