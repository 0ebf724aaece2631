"""Polled readings of a counter board become batches of evenly numbered samples."""

from door_model.recording.batch import SampleBatch, SampleBatcher

from door_encoder.board import Reading


class PollBatcher:
    """Puts readings into time slots of one period; a slot without a reading is a gap.

    A program polls a board earlier or later than it should. A reading fills the slot that is
    nearest to it, so that the time of a sample is wrong by half a period at most. The slot's number
    is the sample's running number.

    Attributes:
        missed: Number of slots that have got no reading since the start.
    """

    def __init__(self, *, period_ns: int, size: int, counts_per_turn: int) -> None:
        """Set the properties of a batch.

        Args:
            period_ns: Time between two samples [ns].
            size: Number of samples in a batch.
            counts_per_turn: Number of counts in a turn of the hinge.
        """
        self._period_ns = period_ns
        self._batcher = SampleBatcher(
            period_ns=period_ns, size=size, counts_per_turn=counts_per_turn
        )
        self._start_ns: int | None = None
        self.missed = 0

    def take(self, at_ns: int, reading: Reading) -> list[SampleBatch]:
        """Add a reading.

        Args:
            at_ns: Time of the measurement on a steady clock [ns].
            reading: What the board returned.

        Returns:
            The batches that are now complete, stamped on the same clock. A batch is complete when
            it has enough samples, and before a gap.
        """
        if self._start_ns is None:
            self._start_ns = at_ns
        slot = (at_ns - self._start_ns + self._period_ns // 2) // self._period_ns
        missing = slot - self._batcher.next_index
        done = []
        if missing > 0:
            self.missed += missing
            done.append(self._batcher.cut())
            self._batcher.skip(missing)
        if reading.index is not None:
            # An index pulse is reported once, so it counts even where the slot is already filled.
            self._batcher.add_index([reading.index])
        if missing >= 0:
            last_ns = self._start_ns + slot * self._period_ns
            done.append(self._batcher.add([reading.count], last_ns))
        return [batch for batch in done if batch is not None]

    def after(self, now_ns: int) -> int:
        """Time from now to the middle of the next slot [ns]; 0 before the first reading."""
        if self._start_ns is None:
            return 0
        return self._period_ns - (now_ns - self._start_ns) % self._period_ns
