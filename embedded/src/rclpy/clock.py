"""Clocks: of the system, steady, and ROS's, which a simulation may drive through `/clock`."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.time import Time

__all__ = ["Clock", "ClockType", "ROSClock"]

_SLEEP_STEP = 0.001


class Clock:
    """A clock of the machine."""

    def __init__(self, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> None:
        """A clock of the given kind."""
        self._clock_type = clock_type
        self._read = time.monotonic_ns if clock_type == ClockType.STEADY_TIME else time.time_ns

    @property
    def clock_type(self) -> ClockType:
        """The kind of clock."""
        return self._clock_type

    @property
    def simulated(self) -> bool:
        """Whether the time comes from `/clock`."""
        return False

    def nanoseconds(self) -> int:
        """The time now [ns], without an object around it."""
        return self._read()

    def now(self) -> Time:
        """The time now."""
        return Time(nanoseconds=self.nanoseconds(), clock_type=self._clock_type)

    def sleep_until(self, until: Time, context: object = None) -> bool:
        """Sleeps until a time on this clock; False if the context was shut down meanwhile."""
        from rclpy.utilities import ok

        while self.nanoseconds() < until.nanoseconds:
            if not ok():
                return False
            left = (until.nanoseconds - self.nanoseconds()) * 1e-9
            time.sleep(_SLEEP_STEP if self.simulated else max(0.0, min(left, 0.1)))
        return ok()

    def sleep_for(self, rel_time: Duration, context: object = None) -> bool:
        """Sleeps for a duration on this clock; False if the context was shut down meanwhile."""
        return self.sleep_until(self.now() + rel_time, context)


class ROSClock(Clock):
    """The system's clock, or with `use_sim_time` what `/clock` told last (at first 0)."""

    def __init__(self) -> None:
        """Shows the system's time at first."""
        super().__init__(clock_type=ClockType.ROS_TIME)
        self._override: int | None = None
        self._listeners: list[Callable[[], None]] = []

    @property
    def ros_time_is_active(self) -> bool:
        """Whether the time comes from `/clock`."""
        return self._override is not None

    @property
    def simulated(self) -> bool:
        """Whether the time comes from `/clock`."""
        return self._override is not None

    def nanoseconds(self) -> int:
        """The time now [ns]."""
        return time.time_ns() if self._override is None else self._override

    def on_jump(self, listener: Callable[[], None]) -> None:
        """Has `listener` called whenever the simulated time is set."""
        self._listeners.append(listener)

    def set_simulated(self, nanoseconds: int | None) -> None:
        """Sets the simulated time, or returns to the system's with None."""
        self._override = nanoseconds
        for listener in self._listeners:
            listener()
