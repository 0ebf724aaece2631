"""Clocks: of the system, steady, and ROS's, which a simulation may drive through `/clock`."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

from rclpy.clock_type import ClockType
from rclpy.context import Context, get_default_context
from rclpy.duration import Duration
from rclpy.exceptions import NotInitializedException
from rclpy.time import Time


class ClockChange(IntEnum):
    """The change of a clock's source that comes with a jump of its time."""

    ROS_TIME_NO_CHANGE = 1
    ROS_TIME_ACTIVATED = 2
    ROS_TIME_DEACTIVATED = 3
    SYSTEM_TIME_NO_CHANGE = 4


class JumpThreshold:
    """The smallest jumps of a clock's time that have callbacks called."""

    def __init__(
        self,
        *,
        min_forward: Duration | None,
        min_backward: Duration | None,
        on_clock_change: bool = True,
    ) -> None:
        """Sets the smallest jumps.

        Args:
            min_forward: Smallest jump forwards, positive; None ignores jumps forwards.
            min_backward: Smallest jump backwards, negative; None ignores jumps backwards.
            on_clock_change: Whether the begin and the end of simulated time count.

        Raises:
            ValueError: A duration has the wrong sign, or all jumps are ignored.
        """
        if min_forward is not None and min_forward.nanoseconds <= 0:
            raise ValueError("min_forward must be a positive non-zero duration")
        if min_backward is not None and min_backward.nanoseconds >= 0:
            raise ValueError("min_backward must be a negative non-zero duration")
        if min_forward is None and min_backward is None and not on_clock_change:
            raise ValueError("At least one jump threshold must be enabled")
        self.min_forward, self.min_backward = min_forward, min_backward
        self.on_clock_change = on_clock_change

    def is_exceeded(self, jump: TimeJump) -> bool:
        """Whether a jump reaches the threshold."""
        if jump.clock_change != ClockChange.ROS_TIME_NO_CHANGE:
            return self.on_clock_change
        back, forward = self.min_backward, self.min_forward
        return (back is not None and jump.delta <= back) or (
            forward is not None and jump.delta >= forward
        )


class TimeJump:
    """A jump of a clock's time."""

    def __init__(self, clock_change: ClockChange, delta: Duration) -> None:
        """Raises TypeError unless `clock_change` is a ClockChange."""
        if not isinstance(clock_change, ClockChange):
            raise TypeError("clock_change must be an instance of rclpy.clock.ClockChange")
        self._clock_change, self._delta = clock_change, delta

    @property
    def clock_change(self) -> ClockChange:
        """Whether simulated time began or ended."""
        return self._clock_change

    @property
    def delta(self) -> Duration:
        """Length of the jump; zero if simulated time begins or ends."""
        return self._delta


class JumpListener(NamedTuple):
    """The functions that a clock calls before and after a jump that exceeds a threshold."""

    threshold: JumpThreshold
    before: Callable[[TimeJump], Any]
    after: Callable[[TimeJump], Any]


class JumpHandle:
    """Callbacks for the jumps of a clock; as a context manager it ends them."""

    def __init__(
        self,
        *,
        clock: Clock,
        threshold: JumpThreshold,
        pre_callback: Callable[[], Any] | None,
        post_callback: Callable[[TimeJump], Any] | None,
    ) -> None:
        """Made by `Clock.create_jump_callback`.

        Raises:
            ValueError: a callback that cannot be called, or none.
        """
        if pre_callback is None and post_callback is None:
            raise ValueError("One of pre_callback or post_callback must be callable")
        for name, callback in (("pre_callback", pre_callback), ("post_callback", post_callback)):
            if callback is not None and not callable(callback):
                raise ValueError(f"{name} must be callable if given")
        self._clock: Clock | None = clock
        self._listener = JumpListener(
            threshold,
            lambda _: None if pre_callback is None else pre_callback(),
            lambda jump: None if post_callback is None else post_callback(jump),
        )
        clock.add_listener(self._listener)

    def unregister(self) -> None:
        """Ends the callbacks; a second call does nothing."""
        clock, self._clock = self._clock, None
        if clock is not None:
            clock.remove_listener(self._listener)

    def __enter__(self) -> JumpHandle:
        """The handle."""
        return self

    def __exit__(self, *_: object) -> None:
        """Ends the callbacks."""
        self.unregister()


class _Sleeper:
    """A wait that any thread and a signal handler can end."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[None] = SimpleQueue()

    def wake(self) -> None:
        self._queue.put(None)

    def wait(self, seconds: float | None) -> None:
        limit = None if seconds is None else min(seconds, threading.TIMEOUT_MAX)
        with suppress(Empty):
            self._queue.get(timeout=limit)


class Clock:
    """A clock of the machine; of the type ROS_TIME it is a `ROSClock`."""

    _clock_type: ClockType
    _listeners: list[JumpListener]

    def __new__(cls, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> Clock:
        """A clock of the given kind; raises TypeError for anything but a ClockType."""
        if not isinstance(clock_type, ClockType):
            raise TypeError("Clock type must be a ClockType enum")
        ros = clock_type == ClockType.ROS_TIME and cls is Clock
        self = object.__new__(ROSClock if ros else cls)
        self._clock_type = clock_type
        self._listeners = []
        return self

    def __repr__(self) -> str:
        """A text with the kind of clock."""
        return f"Clock(clock_type={self._clock_type.name})"

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
        steady = self._clock_type == ClockType.STEADY_TIME
        return time.monotonic_ns() if steady else time.time_ns()

    def now(self) -> Time:
        """The time now."""
        return Time(nanoseconds=self.nanoseconds(), clock_type=self._clock_type)

    def add_listener(self, listener: JumpListener) -> None:
        """Adds a listener of jumps."""
        # A new list: a jump may be going through the old one.
        self._listeners = [*self._listeners, listener]

    def remove_listener(self, listener: JumpListener) -> None:
        """Removes a listener of jumps."""
        self._listeners = [other for other in self._listeners if other is not listener]

    def create_jump_callback(
        self,
        threshold: JumpThreshold,
        *,
        pre_callback: Callable[[], Any] | None = None,
        post_callback: Callable[[TimeJump], Any] | None = None,
    ) -> JumpHandle:
        """Has functions called before and after each jump that reaches the threshold."""
        return JumpHandle(
            clock=self, threshold=threshold, pre_callback=pre_callback, post_callback=post_callback
        )

    def sleep_until(self, until: Time, context: Context | None = None) -> bool:
        """Sleeps until a time on this clock.

        Returns:
            False if the context was shut down meanwhile, or simulated time began or ended.

        Raises:
            NotInitializedException: the context is not initialised or was shut down.
            ValueError: a time of another kind of clock.
        """
        chosen = context or get_default_context()
        if not chosen.ok():
            raise NotInitializedException
        if until.clock_type != self._clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        sleeper, changes = _Sleeper(), []

        def on_jump(jump: TimeJump) -> None:
            if jump.clock_change != ClockChange.ROS_TIME_NO_CHANGE:
                changes.append(jump)
            sleeper.wake()

        threshold = JumpThreshold(min_forward=Duration(nanoseconds=1), min_backward=None)
        chosen.wake_at_end(sleeper)
        with self.create_jump_callback(threshold, post_callback=on_jump):
            left = until.nanoseconds - self.nanoseconds()
            while left > 0 and chosen.ok() and not changes:
                sleeper.wait(None if self.simulated else left * 1e-9)
                left = until.nanoseconds - self.nanoseconds()
        return chosen.ok() and not changes

    def sleep_for(self, rel_time: Duration, context: Context | None = None) -> bool:
        """Sleeps for a duration on this clock; see `sleep_until`."""
        return self.sleep_until(self.now() + rel_time, context)


class ROSClock(Clock):
    """The system's clock, or with `use_sim_time` the last time received on `/clock` (first 0)."""

    _override = 0
    _active = False

    def __new__(cls) -> ROSClock:
        """Shows the system's time at first."""
        return super().__new__(cls, clock_type=ClockType.ROS_TIME)  # type: ignore[return-value]

    @property
    def ros_time_is_active(self) -> bool:
        """Whether the time comes from `/clock`."""
        return self._active

    simulated = ros_time_is_active

    def nanoseconds(self) -> int:
        """The time now [ns]."""
        return self._override if self._active else time.time_ns()

    def set_ros_time_override(self, time: Time) -> None:
        """Sets the time that it shows while simulated time is active."""
        if not isinstance(time, Time):
            raise TypeError(
                f"Time must be specified as rclpy.time.Time. Received type: {type(time)}"
            )
        if not self._active:
            self._override = time.nanoseconds
            return
        delta = Duration(nanoseconds=time.nanoseconds - self._override)
        with self._jump(TimeJump(ClockChange.ROS_TIME_NO_CHANGE, delta)):
            self._override = time.nanoseconds

    def _set_ros_time_is_active(self, enabled: bool) -> None:
        """Begins or ends simulated time."""
        if enabled == self._active:
            return
        on, off = ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED
        with self._jump(TimeJump(on if enabled else off, Duration())):
            self._active = enabled

    @contextmanager
    def _jump(self, jump: TimeJump) -> Iterator[None]:
        listeners = [each for each in self._listeners if each.threshold.is_exceeded(jump)]
        for listener in listeners:
            listener.before(jump)
        yield
        for listener in listeners:
            listener.after(jump)
