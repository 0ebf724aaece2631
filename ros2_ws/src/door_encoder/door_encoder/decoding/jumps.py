"""Steps of the count that no door can make."""

import math

import numpy as np
from door_model.recording.counts import Counts, difference
from numpy.typing import NDArray

CONFIRM = 0.005  # time after which a run that begins where the door can be is believed [s]
SETTLE = 0.1  # time after which a run that begins elsewhere is believed [s]
_UNSEEN = 3.0  # greatest speed of the door while its counts are noise [rad/s]


class JumpFilter:
    """Unwraps a stream of counter values and drops what cannot be the door's motion.

    A step faster than the door's greatest speed begins a run of doubtful samples, and so does a
    gap after which the count is elsewhere. There are two ways back to belief:

    - A run that begins where the door can be by now is believed after `CONFIRM`: the samples before
      it were noise.
    - A run that begins elsewhere is believed after `SETTLE`: the counter has gained or lost counts.
      A door does not jump, so the difference becomes an offset, which is subtracted. It is wrong by
      the door's motion between the last believed sample and the run.

    After a gap of unknown length the door may be anywhere within half a turn.

    Attributes:
        offset: Number of counts that are subtracted from the counter's value.
        jumps: Number of steps that no door can make.
    """

    def __init__(self, *, modulus: int, max_rate: float, half_turn: int) -> None:
        """Set the range of the counter, the door's greatest speed [counts/s] and half a turn."""
        self._modulus, self._max_rate, self._half_turn = modulus, max_rate, half_turn
        self.jumps = 0
        self.reset()

    def reset(self) -> None:
        """Forget the counter's level, as after the counter was switched off."""
        self.offset = 0
        self._count: int | None = None  # unwrapped count of the last believed sample
        self._away = 0.0  # time since then [s]
        self._run = 0  # number of samples in the doubtful run; 0 while samples are believed
        self._near = False  # whether the door can have been where the run began
        self._first = self._last = 0  # first and last counter value of the run
        self._moved = 0  # counts between them

    def reach(self, time: float) -> float:
        """Return the number of counts that the door can move in a time [s], and one for flicker."""
        return min(self._max_rate * time, self._half_turn) + 1.0

    def place(self, value: int) -> int:
        """Return the unwrapped count of a value near the last believed sample, which must exist."""
        assert self._count is not None
        return self._count + difference(value - self.offset, self._count, self._modulus)

    def shift(self, counts: int) -> None:
        """Subtract counts that the counter has gained unnoticed (negative: lost) from now on."""
        assert self._count is not None
        self.offset += counts
        self._count -= counts

    def take(
        self, values: Counts, period: float, elapsed: float
    ) -> tuple[Counts, NDArray[np.bool_]]:
        """Filter neighbouring samples; the result does not depend on where a stream is cut.

        Args:
            values: Counter values (N,).
            period: Time between two samples [s].
            elapsed: Time since the last sample before [s]; infinite if it is not known.

        Returns:
            The unwrapped counts without the offset (N,), and whether each is believed (N,).
        """
        counts = np.zeros(len(values), dtype=np.int64)
        believed = np.zeros(len(values), dtype=bool)
        for at, value in enumerate(values.tolist()):
            count = self._advance(value, elapsed if at == 0 else period, period)
            if count is not None:
                counts[at], believed[at] = count, True
        return counts, believed

    def _advance(self, value: int, time: float, period: float) -> int | None:
        """Return the unwrapped count of the next value; None if it is not believed."""
        self._away += time
        if self._count is None:
            return self._believe(value)
        count = self.place(value)
        distance = abs(count - self._count)
        if not self._run and distance <= self.reach(self._away):
            return self._believe(count)
        step = difference(value, self._last, self._modulus)
        if self._run and math.isfinite(time) and abs(step) <= self.reach(time):
            self._run, self._moved = self._run + 1, self._moved + step
        else:
            unseen = _UNSEEN * self._half_turn / math.pi * self._away
            self._near = distance <= min(unseen, self._half_turn) + self.reach(period)
            self._run, self._moved, self._first = 1, 0, value
            self.jumps += 1
        self._last = value
        if self._run < _samples(CONFIRM if self._near else SETTLE, period):
            return None
        if not self._near:
            self.offset += self.place(self._first) - self._count
        return self._believe(self.place(self._first) + self._moved)

    def _believe(self, count: int) -> int:
        self._count, self._away, self._run = count, 0.0, 0
        return count


def _samples(time: float, period: float) -> int:
    """Return the number of samples, at least two, that last for a time [s]."""
    return max(2, math.ceil(time / period - 1e-6))
