"""Counter boards that are polled: the interface that users implement, and its readings in time."""

import importlib
from abc import ABC, abstractmethod
from dataclasses import dataclass

from door_model.recording.batch import SampleBatch, SampleBatcher

from door_encoder.errors import BoardError

_LIMIT = 2**63  # counts must fit into the signed 64 bits of a message


@dataclass(frozen=True)
class Reading:
    """The values that a counter board returns when it is read.

    Attributes:
        count: Present value of the counter, with any zero and any width.
        index: Value that was latched at the last index pulse; None if no pulse has come since the
            reading before.

    Raises:
        BoardError: A value does not fit into 64 bits.
    """

    count: int
    index: int | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        for value in (self.count, self.index or 0):
            if not -_LIMIT <= value < _LIMIT:
                raise BoardError(quantity="count", value=value, limit="a number of 64 bits")


class CounterBoard(ABC):
    """Base class of counter boards.

    The node counter_board makes a board without arguments, reads it about 1000 times per second
    from one thread, and closes it. If the board cannot be opened, its constructor raises OSError or
    `BoardError`, and the node ends. If `read` raises an error, the node reports it in its log, the
    sample is missing, and the node tries again one period later.

    Attributes:
        counts_per_turn: Number of counts in a turn of the hinge, quadrature included.
    """

    counts_per_turn: int = 14400

    @abstractmethod
    def read(self) -> Reading:
        """Read the counter now; this should take much less than a millisecond."""

    def close(self) -> None:  # noqa: B027
        """Release the board."""


def make_board(name: str) -> CounterBoard:
    """Make a board from the name of its class, `package.module:Class`.

    Raises:
        BoardError: There is no such class, it is no `CounterBoard`, or it cannot be opened.
    """
    module, _, short = name.partition(":")
    problem, board = "is no CounterBoard: derive it from door_encoder.board.CounterBoard", None
    try:
        kind = getattr(importlib.import_module(module), short)
        board = kind() if isinstance(kind, type) and issubclass(kind, CounterBoard) else None
    except (ImportError, AttributeError, ValueError) as error:
        problem = f"must be package.module:Class: {error}"
    except OSError as error:
        problem = f"cannot be opened: {error}"
    if board is None:
        raise BoardError(f"board {name!r} {problem}", quantity="board", value=name)
    return board


class PollBatcher:
    """Puts readings into time slots of one period; a slot without a reading is a gap.

    A program polls a board earlier or later than it should. A reading fills the slot that is
    nearest to it, so that the time of a sample is wrong by half a period at most. The slot's number
    is the sample's running number.

    Attributes:
        missed: Number of slots that have got no reading since the start.
    """

    def __init__(self, *, period_ns: int, size: int, counts_per_turn: int) -> None:
        """Set the time between two samples [ns], the samples of a batch and the resolution."""
        self._period_ns = period_ns
        self._batcher = SampleBatcher(
            period_ns=period_ns, size=size, counts_per_turn=counts_per_turn)
        self._start_ns: int | None = None
        self.missed = 0

    def take(self, at_ns: int, reading: Reading) -> list[SampleBatch]:
        """Add a reading of a time on a steady clock [ns]; return the batches that it completes.

        A batch is complete when it has enough samples, and before a gap.
        """
        if self._start_ns is None:
            self._start_ns = at_ns
        slot = (at_ns - self._start_ns + self._period_ns // 2) // self._period_ns
        missing = slot - self._batcher.next_index
        done: list[SampleBatch | None] = []
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
