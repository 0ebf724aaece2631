"""Stores the samples that were received from the encoder, for an identification."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from door_model.checks import require_positive
from door_model.errors import BadRecordingError, DoorParameterError
from door_model.recording.batch import SampleBatch
from door_model.recording.counts import Counts
from door_model.recording.recording import Recording, from_counts

_SLOWEST = 1.0  # longest time between two samples [s]
_JITTER_NS = 100_000_000  # a batch that lies further back means that the clock was set back [ns]
_UNSTEADY = 0.1  # largest relative difference between a period and that of the stamps


class SampleStore:
    """The newest samples of the door's angle, over a limited time."""

    def __init__(self, memory: float = 300.0) -> None:
        """Keep samples for `memory` seconds; infinite: all.

        Raises:
            DoorParameterError: The memory is not a positive number.
        """
        if memory != math.inf:
            require_positive("memory", memory)
        self._memory_ns = 1e9 * memory
        self._batches: deque[SampleBatch] = deque()

    def add(self, batch: SampleBatch) -> None:
        """Add a batch; one of another encoder, or from well before the newest, empties the store.

        Args:
            batch: Samples with unwrapped counts that are zero at the closed door, or raw ones.

        Raises:
            DoorParameterError: The period or counts_per_turn is out of its range.
        """
        if not 0.0 < batch.period <= _SLOWEST:
            raise DoorParameterError("period", batch.period, f"above 0, up to {_SLOWEST:g} s")
        if batch.counts_per_turn <= 0:
            raise DoorParameterError(
                "counts_per_turn", batch.counts_per_turn, "a positive number")
        if not len(batch.counts):
            return
        if self._batches and (batch.stamp_ns < self._batches[-1].end_ns - _JITTER_NS
                              or batch.counts_per_turn != self._batches[-1].counts_per_turn):
            self._batches.clear()
        self._batches.append(batch)
        oldest = batch.end_ns - self._memory_ns
        while self._batches[0].end_ns < oldest:
            self._batches.popleft()

    def recording(self, *, raw: bool = False) -> Recording:
        """Return all stored samples; times begin at 0, and gaps show in the times.

        Args:
            raw: Whether the counts are those of the counter, which `from_counts` decodes then.

        Raises:
            BadRecordingError: The stamps contradict the period.
        """
        if not self._batches:
            return Recording(np.empty(0), np.empty(0))
        t, counts = self._samples()
        return from_counts(t, counts, self._batches[0].counts_per_turn, raw=raw, own_zero=False)

    def _samples(self) -> tuple[NDArray[np.float64], Counts]:
        """Return times (N,) [s] and counts (N,) without late and repeated samples."""
        stamps = np.array([batch.stamp_ns - self._batches[0].stamp_ns for batch in self._batches])
        period = float(np.median([batch.period for batch in self._batches]))
        numbers = np.diff([float(batch.first_index) for batch in self._batches])
        ahead = numbers > 0
        if ahead.any():
            seen = 1e-9 * float(np.median(np.diff(stamps)[ahead] / numbers[ahead]))
            if abs(seen - period) > _UNSTEADY * period:
                raise BadRecordingError(
                    "the recording", None,
                    f"its batches state a sample every {period:g} s, their stamps one every "
                    f"{seen:g} s", value=seen, limit=period)
        t = np.concatenate([
            1e-9 * (stamp + np.arange(len(batch.counts)) * (batch.period * 1e9))
            for stamp, batch in zip(stamps, self._batches, strict=True)])
        counts = np.concatenate([batch.counts for batch in self._batches])
        fresh = t > np.concatenate([[-np.inf], np.maximum.accumulate(t)[:-1]])
        return t[fresh], counts[fresh]
