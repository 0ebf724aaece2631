"""Recordings that are cut into batches."""

import numpy as np
import pytest
from door_encoder.decoding.decoder import EncoderDecoder
from door_encoder.decoding.settings import Settings
from door_encoder.errors import PlaybackError
from door_encoder.ros.play_node import batches
from door_model.recording.recording import Recording, from_counts
from hypothesis import given
from hypothesis import strategies as st


@given(
    gaps=st.lists(st.integers(1, 300), min_size=1, max_size=400), jitter=st.floats(0.0, 0.2),
    period=st.sampled_from([0.0005, 0.001, 0.004]))
def test_every_sample_comes_out_of_the_decoder(
    gaps: list[int], jitter: float, period: float
) -> None:
    """With holes and jitter, numbers, times, counts and gaps of the decoded samples are right."""
    numbers = np.cumsum([0] * 1 + [1] * 400 + gaps)
    t = 3.0 + period * (numbers + jitter * (numbers % 2))
    counts = np.rint(12 * np.sin(t)).astype(int)
    counts -= counts[0]
    decoder = EncoderDecoder(Settings(zero=0))
    heard: dict[int, int] = {}
    for batch in batches(from_counts(t, counts)):
        assert len(batch.counts) <= round(0.02 / period)
        assert abs(batch.stamp_ns * 1e-9 - t[numbers == batch.first_index][0]) < 1e-8
        for piece in decoder.decode(batch):
            heard |= {piece.first_index + n: int(c) for n, c in enumerate(piece.counts)}
    assert heard == dict(zip(numbers.tolist(), counts.tolist(), strict=True))
    assert decoder.health["gaps"] == sum(gap > 1 for gap in gaps)


def test_angles_become_counts() -> None:
    """A recording in degrees is played with the resolution of the paper's encoder."""
    recording = Recording(np.arange(40) * 1e-3, np.radians(np.arange(40) * 0.025))
    found = batches(recording)
    assert [batch.counts_per_turn for batch in found] == [14400, 14400]
    assert np.concatenate([batch.counts for batch in found]).tolist() == list(range(40))


@pytest.mark.parametrize(
    ("times", "match"),
    [([1.0], "samples is 1"), ([0.0, 0.001, 0.002, 0.0021, 0.003, 0.004], "not evenly spaced")])
def test_what_has_no_period_is_refused(times: list[float], match: str) -> None:
    """A recording of one sample, or with two samples in half a period, is refused."""
    with pytest.raises(PlaybackError, match=match):
        batches(from_counts(np.array(times), np.zeros(len(times), int)))
