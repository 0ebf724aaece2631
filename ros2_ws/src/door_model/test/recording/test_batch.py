"""Batches of encoder samples: numbers, stamps and gaps."""

import numpy as np
import pytest
from door_model.recording.batch import SampleBatcher


def test_encoder_batches_follow_each_other_without_a_gap() -> None:
    """Numbers, stamps and counts of batches join; the stamp is that of the first sample."""
    batcher = SampleBatcher(period_ns=1_000_000, size=20, counts_per_turn=14400)
    batches = []
    for tick in range(1, 13):
        counts = range(5 * (tick - 1), 5 * tick)
        batch = batcher.add(counts, tick * 5_000_000)
        if batch is not None:
            batches.append(batch)
    assert [b.first_index for b in batches] == [0, 20, 40]
    assert not any(b.gap_before for b in batches)
    assert [c for b in batches for c in b.counts] == list(range(60))
    stamps = [1e-9 * b.stamp_ns for b in batches]
    np.testing.assert_allclose(stamps, [0.001, 0.021, 0.041], atol=1e-9)


@pytest.mark.parametrize(("interrupt", "first"), [("skip", 3), ("restart", 0)])
def test_an_interruption_drops_what_was_collected_and_marks_the_gap(
    interrupt: str, first: int
) -> None:
    """Only the first batch after it is marked; a new start counts from 0."""
    batcher = SampleBatcher(period_ns=1_000_000, size=5, counts_per_turn=14400)
    batcher.add([1, 2, 3], 3_000_000)
    batcher.add_index([2])
    getattr(batcher, interrupt)()
    one, other = batcher.add([7] * 5, 5_000_000), batcher.add([8] * 5, 10_000_000)
    assert one is not None
    assert other is not None
    assert (one.first_index, one.gap_before, list(one.counts)) == (first, True, [7] * 5)
    assert interrupt == "skip" or not len(one.index_counts)
    assert (other.first_index, other.gap_before) == (first + 5, False)
