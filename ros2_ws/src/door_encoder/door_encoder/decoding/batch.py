"""Batches of samples, before and after decoding."""

from collections.abc import Sequence
from dataclasses import dataclass

from door_encoder.decoding.counts import Counts
from door_encoder.errors import BadBatchError

_PERIODS = (1e-5, 1.0)  # [s] between two samples
_LAST_NUMBER = 2**63  # of a sample; those that follow still fit into a message


@dataclass(frozen=True)
class Batch:
    """A batch of raw samples.

    Attributes:
        stamp_ns: Time of the first sample [ns].
        period: Time between two samples [s].
        first_index: Running number of the first sample.
        counts_per_turn: Counts a turn that the sender states.
        values: Counter values (N,).
        gap_before: The sender says that samples are missing before this batch.
        index_values: Counter values latched at the index pulses of this batch.
    """

    stamp_ns: int
    period: float
    first_index: int
    counts_per_turn: int
    values: Sequence[int] | Counts
    gap_before: bool = False
    index_values: Sequence[int] | Counts = ()

    def check(self, counts_per_turn: int) -> None:
        """Raise BadBatchError unless this makes sense for an encoder with such a resolution."""
        problem: tuple[str, object, object] | None = None
        if not len(self.values):
            problem = ("is empty", 0, 1)
        elif not _PERIODS[0] <= self.period <= _PERIODS[1]:
            text = f"has a period of {self.period} s, not {_PERIODS[0]:g} to {_PERIODS[1]:g} s"
            problem = (text, self.period, _PERIODS)
        elif self.first_index > _LAST_NUMBER:
            problem = ("has a number that no sender gets to", self.first_index, _LAST_NUMBER)
        elif self.counts_per_turn != counts_per_turn:
            problem = (
                f"has {self.counts_per_turn} counts a turn, not {counts_per_turn}",
                self.counts_per_turn,
                counts_per_turn,
            )
        if problem is not None:
            text, value, limit = problem
            raise BadBatchError(
                f"batch at sample {self.first_index} {text}", value=value, limit=limit
            )


@dataclass(frozen=True)
class Decoded:
    """Neighbouring samples after decoding.

    Attributes:
        stamp_ns: Time of the first sample [ns].
        period: Time between two samples [s].
        first_index: Running number of the first sample.
        counts: Counts (N,), positive when the door opens, zero at the closed door.
        gap_before: Samples are missing, or were dropped, between those before and these.
    """

    stamp_ns: int
    period: float
    first_index: int
    counts: Counts
    gap_before: bool


@dataclass
class Health:
    """What has gone wrong so far, as running totals.

    Attributes:
        batches: Batches taken.
        samples: Samples taken.
        lost: Samples missing by their running numbers.
        gaps: Gaps between batches, by numbers, stamps or the sender's word.
        late: Batches dropped because they came late or twice.
        refused: Batches refused because they made no sense.
        jumps: Steps faster than a door can move.
        dropped: Samples dropped because they followed such a step.
        index_errors: Passages of the index at another count than before.
        restarts: Times the sender began anew.
    """

    batches: int = 0
    samples: int = 0
    lost: int = 0
    gaps: int = 0
    late: int = 0
    refused: int = 0
    jumps: int = 0
    dropped: int = 0
    index_errors: int = 0
    restarts: int = 0
