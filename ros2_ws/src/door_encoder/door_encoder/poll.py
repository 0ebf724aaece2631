"""Polled readings to batches of evenly numbered samples."""

from door_encoder.board import Reading
from door_encoder.decoding.batch import Batch


class PollBatcher:
    """Puts readings into slots of a period; a slot without a reading is a gap.

    A poll by a program comes early or late. It fills the slot that it is nearest to, so that a
    sample's time is off by half a period at most; its number tells the slot.

    Attributes:
        missed: Slots without a reading so far.
    """

    def __init__(self, *, period_ns: int, size: int, counts_per_turn: int) -> None:
        """Set what a batch is.

        Args:
            period_ns: Time between two samples [ns].
            size: Samples in a batch.
            counts_per_turn: Counts a turn of the hinge.
        """
        self._period_ns = period_ns
        self._size = size
        self._counts_per_turn = counts_per_turn
        self._start_ns: int | None = None
        self._next = 0  # slot after the last one that was filled
        self._values: list[int] = []
        self._index_values: list[int] = []
        self._gap = False
        self.missed = 0

    def take(self, at_ns: int, reading: Reading) -> list[Batch]:
        """Take up a reading.

        Args:
            at_ns: When it was measured [ns], on a steady clock.
            reading: What was read.

        Returns:
            Batches that are complete now, stamped on the same clock: when there are enough
            samples, and before a gap.
        """
        if self._start_ns is None:
            self._start_ns = at_ns
        slot = (at_ns - self._start_ns + self._period_ns // 2) // self._period_ns
        if slot < self._next:  # its slot is filled; an index pulse happens once
            self._index_values += [] if reading.index is None else [reading.index]
            return []
        done = []
        if slot > self._next:
            self.missed += slot - self._next
            done += self._cut()
            self._next = slot
            self._gap = True
        self._values.append(reading.count)
        self._index_values += [] if reading.index is None else [reading.index]
        self._next += 1
        if len(self._values) >= self._size:
            done += self._cut()
        return done

    def after(self, now_ns: int) -> int:
        """Time from now to the middle of the next slot [ns]; 0 before the first reading."""
        if self._start_ns is None:
            return 0
        return self._period_ns - (now_ns - self._start_ns) % self._period_ns

    def _cut(self) -> list[Batch]:
        """The samples so far as a batch, if there are any."""
        if not self._values:
            return []
        assert self._start_ns is not None
        first = self._next - len(self._values)
        batch = Batch(
            stamp_ns=self._start_ns + first * self._period_ns,
            period=self._period_ns * 1e-9,
            first_index=first,
            counts_per_turn=self._counts_per_turn,
            values=self._values,
            gap_before=self._gap,
            index_values=self._index_values,
        )
        self._values, self._index_values, self._gap = [], [], False
        return [batch]
