"""Samples heard from the encoder, kept for an identification."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from door_model.checks import require_positive
from door_model.errors import DoorParameterError
from door_model.recording.recording import Recording

_SLOWEST = 1.0  # [s] between two samples
_JITTER_NS = 100_000_000  # more overlap than this is a clock that was set back


@dataclass(frozen=True)
class _Piece:
    start_ns: int
    period_ns: float
    theta: NDArray[np.float64]

    @property
    def end_ns(self) -> int:
        return self.start_ns + round(len(self.theta) * self.period_ns)


class SampleStore:
    """The newest samples of the door's angle, up to a length of time."""

    def __init__(self, memory: float = 300.0) -> None:
        """Keep samples for `memory` seconds.

        Raises:
            DoorParameterError: It is not a positive number.
        """
        require_positive("memory", memory)
        self._memory_ns = round(memory * 1e9)
        self._pieces: deque[_Piece] = deque()
        self._resolution = 0.0

    def add(
        self,
        stamp_ns: int,
        period: float,
        counts_per_turn: int,
        counts: Sequence[int] | NDArray[np.int64],
    ) -> None:
        """Take up a batch; batches from well before the newest sample start it anew.

        Args:
            stamp_ns: Time of the first sample [ns].
            period: Time between two samples [s].
            counts_per_turn: Counts a turn.
            counts: Unwrapped counts, zero at the closed door.

        Raises:
            DoorParameterError: Period or counts_per_turn is out of its range.
        """
        if not 0.0 < period <= _SLOWEST:
            raise DoorParameterError("period", period, f"above 0, up to {_SLOWEST:g} s")
        if counts_per_turn <= 0:
            raise DoorParameterError("counts_per_turn", counts_per_turn, "a positive number")
        if not len(counts):
            return
        resolution = 2.0 * math.pi / counts_per_turn
        if self._pieces and stamp_ns < self._pieces[-1].end_ns - _JITTER_NS:
            self._pieces.clear()
        self._resolution = resolution
        theta = np.asarray(counts, dtype=float) * resolution
        self._pieces.append(_Piece(stamp_ns, period * 1e9, theta))
        oldest = self._pieces[-1].end_ns - self._memory_ns
        while self._pieces[0].end_ns < oldest:
            self._pieces.popleft()

    def recording(self) -> Recording:
        """All that is kept, times from the first sample on; gaps show in the times."""
        if not self._pieces:
            return Recording(np.empty(0), np.empty(0))
        origin = self._pieces[0].start_ns
        times = [
            1e-9 * ((piece.start_ns - origin) + np.arange(len(piece.theta)) * piece.period_ns)
            for piece in self._pieces
        ]
        t = np.concatenate(times)
        theta = np.concatenate([piece.theta for piece in self._pieces])
        fresh = t > np.concatenate([[-np.inf], np.maximum.accumulate(t)[:-1]])
        return Recording(t[fresh], theta[fresh], self._resolution)
