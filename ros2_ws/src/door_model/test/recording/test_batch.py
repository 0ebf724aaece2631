"""Batches of encoder samples: numbers, stamps and gaps."""

import numpy as np
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


def test_a_skip_drops_what_was_collected_and_marks_the_gap() -> None:
    """Only the first batch after it is marked with a gap."""
    batcher = SampleBatcher(period_ns=1_000_000, size=5, counts_per_turn=14400)
    batcher.add([1, 2, 3], 3_000_000)
    batcher.skip()
    first = batcher.add([7] * 5, 5_000_000)
    second = batcher.add([8] * 5, 10_000_000)
    assert first is not None
    assert second is not None
    assert (first.first_index, first.gap_before, list(first.counts)) == (3, True, [7] * 5)
    assert (second.first_index, second.gap_before) == (8, False)


def test_a_new_start_counts_from_0_and_marks_the_gap() -> None:
    """What was collected before is dropped, and only the first batch is marked."""
    batcher = SampleBatcher(period_ns=1_000_000, size=5, counts_per_turn=14400)
    batcher.add([1] * 5, 5_000_000)
    batcher.add([1, 2, 3], 8_000_000)
    batcher.add_index([2])
    batcher.restart()
    assert batcher.next_index == 0
    first = batcher.add([7] * 5, 5_000_000)
    second = batcher.add([8] * 5, 10_000_000)
    assert first is not None
    assert second is not None
    assert (first.first_index, first.gap_before, list(first.counts)) == (0, True, [7] * 5)
    assert not len(first.index_counts)
    assert (second.first_index, second.gap_before) == (5, False)
