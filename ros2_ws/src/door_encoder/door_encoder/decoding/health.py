"""Checks of received batches, and counters of what has gone wrong."""

from dataclasses import dataclass

from door_model.recording.batch import SampleBatch

from door_encoder.errors import BadBatchError

_PERIODS = (1e-5, 1.0)  # shortest and longest time between two samples [s]
_LAST_NUMBER = 2**63  # largest running number; the numbers after it still fit into a message


def require_usable(batch: SampleBatch, counts_per_turn: int) -> None:
    """Check that a batch can come from an encoder with the configured resolution.

    Raises:
        BadBatchError: The batch is empty, its period or its running number is out of range, or
            its resolution is not the configured one.
    """
    problem: tuple[str, object, object] | None = None
    if not len(batch.counts):
        problem = ("has no samples", 0, 1)
    elif not _PERIODS[0] <= batch.period <= _PERIODS[1]:
        text = f"has a period of {batch.period} s, must be {_PERIODS[0]:g} to {_PERIODS[1]:g} s"
        problem = (text, batch.period, _PERIODS)
    elif batch.first_index > _LAST_NUMBER:
        text = f"has a running number beyond the largest one, {_LAST_NUMBER}"
        problem = (text, batch.first_index, _LAST_NUMBER)
    elif batch.counts_per_turn != counts_per_turn:
        text = f"has {batch.counts_per_turn} counts per turn, configured are {counts_per_turn}"
        problem = (text, batch.counts_per_turn, counts_per_turn)
    if problem is not None:
        text, value, limit = problem
        raise BadBatchError(
            f"the batch at sample {batch.first_index} {text}", value=value, limit=limit
        )


@dataclass
class Health:
    """Running totals since the decoder was started.

    Attributes:
        batches: Number of accepted batches.
        samples: Number of accepted samples.
        lost: Number of samples that are missing according to the running numbers.
        gaps: Number of gaps between batches, according to running numbers, stamps or the sender.
        late: Number of batches that were dropped because they came late or twice.
        refused: Number of batches that were refused because they make no sense.
        jumps: Number of steps faster than a door can move.
        dropped: Number of samples that were dropped because they followed such a step.
        index_errors: Number of passages of the index at another count than before.
        restarts: Number of times that the sender began anew.
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
