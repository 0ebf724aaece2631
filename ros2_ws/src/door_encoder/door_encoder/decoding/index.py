"""The encoder's index (Z) pulse, which comes once per turn and always at the same angle."""

from dataclasses import dataclass

from door_model.recording.counts import difference

TOLERANCE = 4  # [counts]; an ungated index is as wide as a line, and is passed from either side


@dataclass(frozen=True)
class Passage:
    """A passage of the index, compared with the first one.

    Attributes:
        error: Number of counts that the counter has gained since the first passage (negative:
            lost); 0 within `TOLERANCE`.
        sure: Whether the error is confirmed: a single deviating passage may be noise on the index
            line, so a second one in a row must show the same error.
    """

    error: int
    sure: bool


class IndexCheck:
    """Finds counts that were gained or lost between two passages of the index.

    Attributes:
        reference: Unwrapped count at the first passage; None until then.
    """

    def __init__(self, counts_per_turn: int) -> None:
        self._counts_per_turn = counts_per_turn
        self.reset()

    def reset(self) -> None:
        """Forget where the index is."""
        self.reference: int | None = None
        self._suspect: int | None = None  # error of a single deviating passage [counts]

    def learn(self, count: int) -> None:
        """Accept a count as that of the index."""
        self.reference = count

    def judge(self, count: int) -> Passage:
        """Compare a passage at a count with the reference, which must exist."""
        assert self.reference is not None
        error = difference(count, self.reference, self._counts_per_turn)
        if abs(error) <= TOLERANCE:
            self._suspect = None
            return Passage(0, True)
        sure = self._suspect is not None and abs(error - self._suspect) <= TOLERANCE
        self._suspect = None if sure else error
        return Passage(error, sure)
