"""A counter board that is polled: what to implement for one's own."""

import importlib
from abc import ABC, abstractmethod
from dataclasses import dataclass

from door_encoder.errors import BoardError


@dataclass(frozen=True)
class Reading:
    """What a counter board says at a moment.

    Attributes:
        count: The counter's value, whatever its zero and however it wraps.
        index: Its value latched at the last index pulse, where one came since the reading before.

    Raises:
        BoardError: A value does not fit into 64 bits.
    """

    count: int
    index: int | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        for value in (self.count, self.index or 0):
            if not -(2**63) <= value < 2**63:
                raise BoardError(f"a count of {value} has more than 64 bits", value=value, limit=64)


class CounterBoard(ABC):
    """Base class of counter boards.

    A board is made without arguments, read some 1000 times a second from one thread, and closed.
    What cannot be opened raises OSError or `BoardError`, and the node ends. Whatever `read` raises
    is told, and makes a missing sample; the next one is tried.

    Attributes:
        counts_per_turn: Counts a turn of the hinge, quadrature included.
    """

    counts_per_turn: int = 14400

    @abstractmethod
    def read(self) -> Reading:
        """Read the counter now; should take much less than a millisecond."""

    def close(self) -> None:  # noqa: B027
        """Let the board go."""


def make_board(name: str) -> CounterBoard:
    """Make a board.

    Args:
        name: `package.module:Class`, where Python finds it.

    Raises:
        BoardError: There is no such class, or it cannot be opened.
    """
    module, _, short = name.partition(":")
    try:
        kind = getattr(importlib.import_module(module), short)
    except (ImportError, AttributeError, ValueError) as error:
        raise BoardError(
            f"board must be package.module:Class, not {name!r}: {error}",
            value=name,
            limit="package.module:Class",
        ) from error
    if not (isinstance(kind, type) and issubclass(kind, CounterBoard)):
        raise BoardError(
            f"board {name} is no CounterBoard", value=name, limit=CounterBoard.__name__
        )
    try:
        return kind()
    except OSError as error:
        raise BoardError(f"board {name} cannot be opened: {error}", value=name) from error
