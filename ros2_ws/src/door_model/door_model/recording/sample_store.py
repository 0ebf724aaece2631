"""Stores the samples that were received from the encoder, for an identification."""

import math
from collections import deque

import numpy as np

from door_model.checks import require_positive
from door_model.errors import DoorParameterError
from door_model.recording.batch import SampleBatch
from door_model.recording.recording import Recording

_SLOWEST = 1.0  # longest time between two samples [s]
_JITTER_NS = 100_000_000  # a batch that lies further back means that the clock was set back [ns]


class SampleStore:
    """The newest samples of the door's angle, over a limited time."""

    def __init__(self, memory: float = 300.0) -> None:
        """Keep samples for `memory` seconds.

        Raises:
            DoorParameterError: The memory is not a positive number.
        """
        require_positive("memory", memory)
        self._memory_ns = round(memory * 1e9)
        self._batches: deque[SampleBatch] = deque()

    def add(self, batch: SampleBatch) -> None:
        """Add a batch; a batch from well before the newest sample empties the store first.

        Args:
            batch: Samples with unwrapped counts that are zero at the closed door.

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
        if self._batches and batch.stamp_ns < self._batches[-1].end_ns - _JITTER_NS:
            self._batches.clear()
        self._batches.append(batch)
        oldest = batch.end_ns - self._memory_ns
        while self._batches[0].end_ns < oldest:
            self._batches.popleft()

    def recording(self) -> Recording:
        """Return all stored samples; times begin at 0, and gaps show in the times."""
        if not self._batches:
            return Recording(np.empty(0), np.empty(0))
        origin = self._batches[0].stamp_ns
        t = np.concatenate([
            1e-9 * ((batch.stamp_ns - origin)
                    + np.arange(len(batch.counts)) * (batch.period * 1e9))
            for batch in self._batches
        ])
        theta = np.concatenate([
            np.asarray(batch.counts, dtype=float) * _resolution(batch) for batch in self._batches
        ])
        fresh = t > np.concatenate([[-np.inf], np.maximum.accumulate(t)[:-1]])
        return Recording(t[fresh], theta[fresh], _resolution(self._batches[-1]))


def _resolution(batch: SampleBatch) -> float:
    """Return the angle of one count [rad]."""
    return 2.0 * math.pi / batch.counts_per_turn
