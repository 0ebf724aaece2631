"""The encoder's index (Z) pulse: once a turn, always at the same angle."""

from dataclasses import dataclass

from door_encoder.decoding.counts import difference

TOLERANCE = 4  # [counts] an ungated index is as wide as a line, and seen from either side


@dataclass(frozen=True)
class Passage:
    """A passage of the index beside the first one.

    Attributes:
        error: Counts that the counter has gained since (negative: lost); 0 within `TOLERANCE`.
        sure: Whether the passage before says the same: one alone may be noise on the index line.
    """

    error: int
    sure: bool


class IndexCheck:
    """Finds counts that were lost between two passages of the index.

    Attributes:
        reference: Count at the first passage; None until there was one.
    """

    def __init__(self, counts_per_turn: int) -> None:
        self._counts_per_turn = counts_per_turn
        self.reset()

    def reset(self) -> None:
        """Forget where the index is."""
        self.reference: int | None = None
        self._suspect: int | None = None

    def learn(self, count: int) -> None:
        """Take a count for the index's."""
        self.reference = count

    def judge(self, count: int) -> Passage:
        """Compare a passage at a count with the reference, which there must be."""
        assert self.reference is not None
        error = difference(count, self.reference, self._counts_per_turn)
        if abs(error) <= TOLERANCE:
            self._suspect = None
            return Passage(0, True)
        sure = self._suspect is not None and abs(error - self._suspect) <= TOLERANCE
        self._suspect = None if sure else error
        return Passage(error, sure)
