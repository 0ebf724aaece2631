"""Counts that jump: noise, lost counts, a counter that is reset, and the index pulse."""

from collections.abc import Sequence

import numpy as np
import pytest
from door_encoder.decoding.decoder import EncoderDecoder
from door_encoder.decoding.index import TOLERANCE
from door_encoder.decoding.report import Level, assess
from door_encoder.decoding.settings import Settings
from door_model.recording.batch import SampleBatch
from door_model.recording.counts import wrap
from hypothesis import given
from hypothesis import strategies as st

SETTLE = 100  # samples
CONFIRM = 5


def swing(samples: int) -> np.ndarray:
    """Return counts of a door that rests for 200 ms and then swings by 1000 counts."""
    t = np.maximum(0.0, np.arange(samples) * 1e-3 - 0.2)
    return np.rint(500.0 * (1.0 - np.cos(2.0 * np.pi * t / 1.0))).astype(np.int64)


def stream(
    decoder: EncoderDecoder,
    values: Sequence[int] | np.ndarray,
    size: int = 20,
    first: int = 0,
    index: dict[int, list[int]] | None = None,
) -> list[SampleBatch]:
    """Decode a stream; `index` maps samples to values that are latched in their batch."""
    found = []
    for start in range(0, len(values), size):
        number = first + start
        latched = [value for at, row in (index or {}).items() if number <= at < number + size
                   for value in row]  # fmt: skip
        part = np.asarray(values[start : start + size])
        found += decoder.decode(
            SampleBatch(10**9 + number * 10**6, 1e-3, number, 14400, part, index_counts=latched)
        )
    return found


def by_number(pieces: list[SampleBatch]) -> dict[int, int]:
    """Return the counts by the running numbers of the samples."""
    return {
        piece.first_index + at: int(count)
        for piece in pieces
        for at, count in enumerate(piece.counts)
    }


def stamps_fit(pieces: list[SampleBatch]) -> bool:
    """Return whether each piece is stamped with the time of its first sample."""
    return all(piece.stamp_ns == 10**9 + piece.first_index * 10**6 for piece in pieces)


def gaps_fit(pieces: list[SampleBatch]) -> bool:
    """Return whether there is a gap wherever numbers are missing."""
    ends = [piece.first_index + len(piece.counts) for piece in pieces]
    return all(
        after.gap_before or after.first_index == end
        for end, after in zip(ends, pieces[1:], strict=False)
    )


@given(
    at=st.integers(300, 900),
    noise=st.lists(st.integers(-(2**63), 2**63 - 1), min_size=1, max_size=80),
    size=st.sampled_from([1, 7, 20, 60]),
    modulus=st.sampled_from([0, 2**16, 2**32]),
)
def test_noise_never_comes_out_as_motion(
    at: int, noise: list[int], size: int, modulus: int
) -> None:
    """Any garbage is kept out: the output stays within what the door can move, with gaps marked."""
    truth = swing(1200)
    values = wrap(truth + 77, modulus)
    values[at : at + len(noise)] = noise
    decoder = EncoderDecoder(Settings(modulus=modulus))
    pieces = stream(decoder, values, size)
    found = by_number(pieces)
    assert gaps_fit(pieces)
    assert stamps_fit(pieces)
    reach = 47 * (len(noise) + 1)
    off = {number: abs(count - int(truth[number])) for number, count in found.items()}
    assert max(off.values()) <= reach
    assert all(off[number] == 0 for number in range(20, at))


@given(at=st.integers(300, 900), length=st.integers(1, 99), by=st.integers(5000, 30000))
def test_where_the_count_comes_back_all_goes_on(at: int, length: int, by: int) -> None:
    """A burst that gains no counts is dropped with 4 ms after it; all other samples are exact."""
    truth = swing(1200)
    values = truth.copy()
    values[at : at + length] += by
    decoder = EncoderDecoder(Settings())
    pieces = stream(decoder, values)
    back = at + length + CONFIRM - 1
    expected = {n: int(c) for n, c in enumerate(truth) if not at <= n < back}
    assert by_number(pieces) == expected
    assert [piece.first_index for piece in pieces if piece.gap_before] == [back]
    assert decoder.health.jumps == 2
    assert decoder.health.dropped == back - at
    assert not decoder.zero_in_doubt
    assert decoder.offset == 0


@given(
    at=st.integers(300, 900),
    by=st.integers(60, 7000) | st.integers(-7000, -60),
    size=st.sampled_from([1, 7, 20, 60]),
    modulus=st.sampled_from([0, 2**16, 2**32]),
)
def test_an_offset_that_stays_is_taken_out(at: int, by: int, size: int, modulus: int) -> None:
    """Counts gained for good cost 100 samples; then the door is known to 3 counts."""
    truth = swing(1200)
    values = truth.copy()
    values[at:] += by
    decoder = EncoderDecoder(Settings(modulus=modulus))
    pieces = stream(decoder, wrap(values, modulus), size)
    found = by_number(pieces)
    assert set(range(20, 1200)) - set(found) == set(range(at, at + SETTLE - 1))
    assert max(abs(count - truth[number]) for number, count in found.items()) <= 3
    assert gaps_fit(pieces)
    assert stamps_fit(pieces)
    assert decoder.zero_in_doubt
    assert decoder.offset == pytest.approx(by, abs=3)
    verdict = assess(decoder, 0.0, {})
    assert verdict.level is Level.WARN
    assert "zero in doubt" in verdict.message
    assert verdict.values["offset"] == str(decoder.offset)
    assert "zero in doubt" in assess(decoder, 0.0, verdict.totals).message


@given(at=st.integers(300, 900), length=st.integers(10, 60), by=st.integers(600, 7000))
def test_noise_that_costs_counts_leaves_the_zero_in_doubt(at: int, length: int, by: int) -> None:
    """A burst that leaves an offset is recognised: no door gets so far and then moves slowly."""
    truth = swing(1400)
    values = truth.copy()
    values[at:] -= by
    values[at : at + length] = np.random.default_rng(at).integers(-(2**31), 2**31, length)
    decoder = EncoderDecoder()
    found = by_number(stream(decoder, values))
    assert decoder.zero_in_doubt
    late = {number: count for number, count in found.items() if number >= at}
    assert all(abs(count - truth[number]) <= 3 + length for number, count in late.items())


def test_a_first_level_that_did_not_last_is_no_reference() -> None:
    """With garbage at the start, the level that lasts is the counter's and gives the zero."""
    decoder = EncoderDecoder()
    pieces = stream(decoder, np.concatenate([np.full(40, 9000), swing(900)]))
    found = by_number(pieces)
    assert max(abs(found[40 + n] - swing(900)[n]) for n in range(SETTLE, 900)) == 0
    assert not decoder.zero_in_doubt
    known = EncoderDecoder(Settings(zero=0))
    stream(known, np.concatenate([np.full(40, 9000), swing(900)]))
    assert known.offset == 0
    assert known.zero == 0.0


def test_a_restart_is_no_jump() -> None:
    """If a sender restarts while counts are doubtful, its counter gives a new zero."""
    decoder = EncoderDecoder()
    stream(decoder, np.concatenate([swing(400), np.full(50, 12000)]))
    for stamp_ns in (10**10, 0):
        batch = SampleBatch(stamp_ns, 1e-3, 0, 14400, [7] * 20)
        (piece,) = decoder.decode(batch)
        assert piece.gap_before
        assert (piece.counts == 0).all()
        assert decoder.offset == 0
        assert not decoder.zero_in_doubt
        stream(decoder, [7] * 400, first=20)
    assert decoder.health.restarts == 2
    assert decoder.health.jumps == 1


def test_behind_a_gap_of_unknown_length_the_door_may_be_elsewhere() -> None:
    """A simulation that is reset puts the door back to zero without a jump or dropped samples."""
    decoder = EncoderDecoder()
    stream(decoder, swing(700))
    batch = SampleBatch(2 * 10**9, 1e-3, 700, 14400, [0] * 20, gap_before=True)
    (piece,) = decoder.decode(batch)
    assert piece.gap_before
    assert piece.counts.tolist() == [0] * 20
    assert decoder.health.jumps == decoder.health.dropped == 0


@given(
    at=st.integers(300, 900),
    noise=st.lists(st.integers(-(2**63), 2**63 - 1) | st.integers(0, 200), max_size=150),
    by=st.integers(-3000, 3000),
    sizes=st.lists(st.integers(1, 90), min_size=1),
    modulus=st.sampled_from([0, 2**16, 14400]),
)
def test_where_the_stream_is_cut_makes_no_difference(
    at: int, noise: list[int], by: int, sizes: list[int], modulus: int
) -> None:
    """With noise and an offset, batches of any size decode to the same samples."""
    values = swing(1400)
    values[at:] += by
    values = wrap(values, modulus)
    values[at : at + len(noise)] = noise
    whole, cut = (EncoderDecoder(Settings(modulus=modulus)) for _ in range(2))
    expected = by_number(stream(whole, values, 100))
    found, first = [], 0
    for size in sizes * 1400:
        found += stream(cut, values[first : first + size], first=first)
        first += size
        if first >= len(values):
            break
    later = {number: count for number, count in by_number(found).items() if number >= 100}
    assert later == {number: count for number, count in expected.items() if number >= 100}
    assert cut.health.dropped == whole.health.dropped


# -- the index -------------------------------------------------------------------------------------


def passages(truth: np.ndarray, place: int) -> list[int]:
    """Return the samples at which a door passes a count."""
    beyond = truth >= place
    return (np.flatnonzero(beyond[1:] != beyond[:-1]) + 1).tolist()


def latched(values: np.ndarray, truth: np.ndarray, place: int) -> dict[int, list[int]]:
    """Return what the counter shows as the door passes a count, by samples."""
    return {n: [int(values[n] - truth[n]) + place] for n in passages(truth, place)}


@given(
    lost=st.integers(-40, 40).filter(lambda n: abs(n) > TOLERANCE + 2),
    place=st.integers(100, 900),
    flicker=st.lists(st.integers(-1, 1), min_size=10, max_size=10),
)
def test_counts_lost_between_two_passages_are_found(
    lost: int, place: int, flicker: list[int]
) -> None:
    """Two passages reveal a loss too small for a jump: a gap is marked, the rest is right again."""
    truth = swing(3000)
    values = truth + 5
    values[720:] -= lost
    at = passages(truth, place)
    index = latched(values, truth, place)
    index = {n: [index[n][0] + add] for n, add in zip(at, flicker, strict=False)}
    decoder = EncoderDecoder()
    pieces = stream(decoder, values, index=index)
    found = by_number(pieces)
    assert decoder.health.index_errors == 2
    assert abs(decoder.offset + lost) <= 2
    assert all(abs(found[n] - truth[n]) <= 2 for n in range(max(at[:4]) + 20, 3000))
    assert any(piece.gap_before for piece in pieces)
    assert not decoder.zero_in_doubt


def test_an_index_without_trouble_changes_nothing() -> None:
    """Passages at the same count cause no error and no gap, in any direction and turn."""
    truth = swing(3000)
    at = passages(truth, 300)
    index = {n: [300 + 14400 * (n % 2)] for n in at}
    decoder = EncoderDecoder()
    pieces = stream(decoder, truth, index=index)
    assert by_number(pieces) == dict(enumerate(truth.tolist()))
    assert not any(piece.gap_before for piece in pieces)
    assert decoder.index.reference == pytest.approx(300, abs=4)


def test_the_index_takes_the_zero_out_of_doubt() -> None:
    """After an offset, a passage at the expected count confirms the offset."""
    truth = swing(3000)
    values = truth.copy()
    values[750:] += 2000
    decoder = EncoderDecoder()
    index = latched(values, truth, 300)
    pieces = stream(decoder, values, index=index)
    assert decoder.offset == pytest.approx(2000, abs=3)
    assert not decoder.zero_in_doubt
    assert by_number(pieces)[2999] == pytest.approx(truth[2999], abs=3)


def test_a_single_stray_index_moves_nothing() -> None:
    """Noise on the index line, at the door or elsewhere, is counted and otherwise ignored."""
    truth = swing(3000)
    index = latched(truth, truth, 300)
    index[690] = [int(truth[690])]
    index[1400] = [123456]
    decoder = EncoderDecoder()
    found = by_number(stream(decoder, truth, index=index))
    assert found == dict(enumerate(truth.tolist()))
    assert decoder.health.index_errors == 2
