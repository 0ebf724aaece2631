"""Batches of encoder samples, and a batcher that cuts a stream of samples into them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from door_model.recording.counts import Counts


def _none() -> Counts:
    """Return an empty array of counts."""
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class SampleBatch:
    """Evenly spaced samples of the door's encoder, as in a message EncoderSamples.

    The counts are either raw values of the counter, or decoded ones: unwrapped, positive when the
    door opens and zero at the closed door. Sequences of integers are converted to arrays.

    Attributes:
        stamp_ns: Time of the first sample [ns].
        period: Time between two samples [s].
        first_index: Running number of the first sample.
        counts_per_turn: Number of counts in a turn of the hinge.
        counts: One count for each sample (N,).
        gap_before: Whether samples are missing between the batch before and this batch.
        index_counts: Raw counter values that were latched at the encoder's index pulses during
            the batch (M,).
    """

    stamp_ns: int
    period: float
    first_index: int
    counts_per_turn: int
    counts: Counts
    gap_before: bool = False
    index_counts: Counts = field(default_factory=_none)

    def __post_init__(self) -> None:
        """Convert the counts to arrays."""
        for name in ("counts", "index_counts"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.int64))

    @property
    def end_ns(self) -> int:
        """Time at which the next sample is due [ns]."""
        return self.stamp_ns + round(len(self.counts) * (self.period * 1e9))


def to_batch(message: Any) -> SampleBatch:
    """Return the batch of a message EncoderSamples, received or read from a recording."""
    stamp = message.header.stamp
    return SampleBatch(
        stamp_ns=stamp.sec * 1_000_000_000 + stamp.nanosec,
        period=message.period,
        first_index=message.first_index,
        counts_per_turn=message.counts_per_turn,
        counts=message.counts,
        gap_before=message.gap_before,
        # Older recordings were made before the message had this field.
        index_counts=getattr(message, "index_counts", _none()),
    )


class SampleBatcher:
    """Numbers evenly spaced samples and cuts them into batches."""

    def __init__(self, *, period_ns: int, size: int, counts_per_turn: int) -> None:
        """Set the properties of a batch.

        Args:
            period_ns: Time between two samples [ns].
            size: Number of samples that complete a batch.
            counts_per_turn: Number of counts in a turn of the hinge.
        """
        self._period_ns = period_ns
        self._size = size
        self._counts_per_turn = counts_per_turn
        self._next_index = 0  # running number of the next sample
        self._last_ns = 0  # time of the last sample [ns]
        self._counts: list[int] = []
        self._index_counts: list[int] = []
        self._gap = False

    @property
    def next_index(self) -> int:
        """Running number of the next sample."""
        return self._next_index

    def add(self, counts: Sequence[int], last_ns: int) -> SampleBatch | None:
        """Add samples.

        Args:
            counts: Counter values, in order of time.
            last_ns: Time of the last of them [ns].

        Returns:
            A batch of all collected samples where they are enough, else None.
        """
        self._counts.extend(counts)
        self._next_index += len(counts)
        self._last_ns = last_ns
        return self.cut() if len(self._counts) >= self._size else None

    def add_index(self, counts: Iterable[int]) -> None:
        """Add counter values that were latched at index pulses, to the batch being collected."""
        self._index_counts.extend(counts)

    def cut(self) -> SampleBatch | None:
        """Return a batch of the samples that are collected; None where there are none."""
        size = len(self._counts)
        if not size:
            return None
        batch = SampleBatch(
            stamp_ns=self._last_ns - (size - 1) * self._period_ns, period=self._period_ns * 1e-9,
            first_index=self._next_index - size, counts_per_turn=self._counts_per_turn,
            counts=np.array(self._counts, dtype=np.int64), gap_before=self._gap,
            index_counts=np.array(self._index_counts, dtype=np.int64))
        self._counts, self._index_counts, self._gap = [], [], False
        return batch

    def skip(self, missing: int = 0) -> None:
        """Drop the samples that are collected, and mark a gap before the next batch.

        Args:
            missing: Number of samples that are missing besides; their numbers are left out.
        """
        self._next_index += missing
        self._counts = []
        self._gap = True

    def restart(self) -> None:
        """Begin anew with number 0 behind a gap, which tells receivers that the counter is new."""
        self.skip()
        self._next_index = 0
        self._index_counts = []
