"""Lengths of time."""

from __future__ import annotations

from functools import total_ordering
from typing import Any

from ros2_embedded.messages import message_class

S_TO_NS = 1_000_000_000


def split_nanoseconds(nanoseconds: int) -> dict[str, int]:
    """Seconds and nanoseconds as the messages Time and Duration have them."""
    sec, nanosec = divmod(nanoseconds, S_TO_NS)
    return {"sec": sec, "nanosec": nanosec}


@total_ordering
class Duration:
    """A length of time in whole nanoseconds."""

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        """The sum of both arguments.

        Raises:
            OverflowError: more than 64 bits of nanoseconds.
        """
        total = int(seconds * S_TO_NS) + int(nanoseconds)
        if not -(1 << 63) <= total < 1 << 63:
            raise OverflowError("Total nanoseconds value is too large to store in C duration.")
        self._nanoseconds = total

    @property
    def nanoseconds(self) -> int:
        """The length [ns]."""
        return self._nanoseconds

    def __repr__(self) -> str:
        """A text with the nanoseconds."""
        return f"Duration(nanoseconds={self._nanoseconds})"

    def __str__(self) -> str:
        """The text that `ros2 topic info --verbose` prints."""
        return "Infinite" if self == Infinite else f"{self._nanoseconds} nanoseconds"

    def __eq__(self, other: object) -> bool:
        """Same length."""
        if not isinstance(other, Duration):
            return NotImplemented
        return self._nanoseconds == other._nanoseconds

    def __lt__(self, other: Duration) -> bool:
        """Shorter."""
        if not isinstance(other, Duration):
            return NotImplemented
        return self._nanoseconds < other._nanoseconds

    def __hash__(self) -> int:
        """By length."""
        return hash(self._nanoseconds)

    def to_msg(self) -> Any:
        """Converts the duration to builtin_interfaces/msg/Duration."""
        message = message_class("builtin_interfaces/msg/Duration")
        return message(**split_nanoseconds(self._nanoseconds))

    @classmethod
    def from_msg(cls, msg: Any) -> Duration:
        """From builtin_interfaces/msg/Duration.

        Raises:
            TypeError: another message.
        """
        if not isinstance(msg, message_class("builtin_interfaces/msg/Duration")):
            raise TypeError("Must pass a builtin_interfaces.msg.Duration object")
        return cls(nanoseconds=msg.sec * S_TO_NS + msg.nanosec)


Infinite = Duration(nanoseconds=(1 << 63) - 1)
