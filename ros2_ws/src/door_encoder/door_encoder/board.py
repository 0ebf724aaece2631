"""The interface of a counter board that is polled; users implement it for their own board."""

import importlib
from abc import ABC, abstractmethod
from dataclasses import dataclass

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
                raise BoardError(
                    f"the board has returned a count of {value}, which does not fit into 64 bits",
                    quantity="count",
                    value=value,
                    limit=_LIMIT,
                )


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
    """Make a board from the name of its class.

    Args:
        name: Name of the class as `package.module:Class`, in a module that Python can import.

    Raises:
        BoardError: There is no such class, it is no `CounterBoard`, or it cannot be opened.
    """
    module, _, short = name.partition(":")
    try:
        kind = getattr(importlib.import_module(module), short)
    except (ImportError, AttributeError, ValueError) as error:
        raise BoardError(
            f"board must be package.module:Class, not {name!r}: {error}",
            quantity="board",
            value=name,
            limit="package.module:Class",
        ) from error
    if not (isinstance(kind, type) and issubclass(kind, CounterBoard)):
        raise BoardError(
            f"board {name} is no CounterBoard: derive it from door_encoder.board.CounterBoard",
            quantity="board",
            value=name,
            limit=CounterBoard.__name__,
        )
    try:
        return kind()
    except OSError as error:
        raise BoardError(
            f"board {name} cannot be opened: {error}",
            quantity="board",
            value=name,
            limit="a board that can be opened",
        ) from error
