"""Points in time."""

from __future__ import annotations

from functools import total_ordering
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.clock_type import ClockType
from rclpy.duration import S_TO_NS, Duration, split_nanoseconds


@total_ordering
class Time:
    """A point in time on a clock, in whole nanoseconds."""

    def __init__(
        self,
        *,
        seconds: float = 0,
        nanoseconds: int = 0,
        clock_type: ClockType = ClockType.SYSTEM_TIME,
    ) -> None:
        """The sum of seconds and nanoseconds.

        Raises:
            TypeError: `clock_type` is not a ClockType.
            ValueError: a negative argument.
            OverflowError: more than 63 bits of nanoseconds.
        """
        if not isinstance(clock_type, ClockType):
            raise TypeError("Clock type must be a ClockType enum")
        if seconds < 0:
            raise ValueError("Seconds value must not be negative")
        if nanoseconds < 0:
            raise ValueError("Nanoseconds value must not be negative")
        total = int(seconds * S_TO_NS) + int(nanoseconds)
        if total >= 1 << 63:
            raise OverflowError("Total nanoseconds value is too large to store in C time point.")
        self._nanoseconds = total
        self._clock_type = clock_type

    @property
    def nanoseconds(self) -> int:
        """Since the clock's origin [ns]."""
        return self._nanoseconds

    @property
    def clock_type(self) -> ClockType:
        """The kind of clock."""
        return self._clock_type

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Whole seconds, and the nanoseconds beyond them."""
        return divmod(self._nanoseconds, S_TO_NS)

    def __repr__(self) -> str:
        """A text with nanoseconds and kind of clock."""
        return f"Time(nanoseconds={self._nanoseconds}, clock_type={self._clock_type.name})"

    def _same_clock(self, other: Time, verb: str = "compare") -> None:
        if self._clock_type != other._clock_type:
            raise TypeError(f"Can't {verb} times with different clock types")

    def __add__(self, other: Duration) -> Time:
        """Later by a duration."""
        if not isinstance(other, Duration):
            return NotImplemented
        total = self._nanoseconds + other.nanoseconds
        try:
            return Time(nanoseconds=total, clock_type=self._clock_type)
        except OverflowError as error:
            raise OverflowError("Addition leads to overflow in C storage.") from error

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        """The duration between two times, or the time earlier by a duration."""
        if isinstance(other, Time):
            self._same_clock(other, "subtract")
            return Duration(nanoseconds=self._nanoseconds - other._nanoseconds)
        if isinstance(other, Duration):
            left = self._nanoseconds - other.nanoseconds
            if left < 0:
                raise ValueError("Subtraction leads to negative time.")
            return Time(nanoseconds=left, clock_type=self._clock_type)
        return NotImplemented

    def __eq__(self, other: object) -> bool:
        """Whether both are the same time; raises TypeError for different kinds of clocks."""
        if not isinstance(other, Time):
            return NotImplemented
        self._same_clock(other)
        return self._nanoseconds == other._nanoseconds

    def __lt__(self, other: Time) -> bool:
        """Earlier."""
        if not isinstance(other, Time):
            return NotImplemented
        self._same_clock(other)
        return self._nanoseconds < other._nanoseconds

    def __hash__(self) -> int:
        """By time and clock."""
        return hash((self._nanoseconds, self._clock_type))

    def to_msg(self) -> Any:
        """Converts the time to builtin_interfaces/msg/Time."""
        return message_class("builtin_interfaces/msg/Time")(**split_nanoseconds(self._nanoseconds))

    @classmethod
    def from_msg(cls, msg: Any, clock_type: ClockType = ClockType.ROS_TIME) -> Time:
        """From builtin_interfaces/msg/Time.

        Raises:
            TypeError: another message.
        """
        if not isinstance(msg, message_class("builtin_interfaces/msg/Time")):
            raise TypeError("Must pass a builtin_interfaces.msg.Time object")
        return cls(nanoseconds=msg.sec * S_TO_NS + msg.nanosec, clock_type=clock_type)
