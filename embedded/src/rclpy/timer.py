"""Timers and rates."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockChange, JumpListener, JumpThreshold, TimeJump
from rclpy.context import Context, get_default_context
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle, RCLError, ROSInterruptException

_ANY_JUMP = JumpThreshold(
    min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1)
)


class Timer:
    """Calls a function periodically."""

    def __init__(
        self,
        callback: Callable[[], Any],
        callback_group: CallbackGroup,
        timer_period_ns: int,
        clock: Clock,
        *,
        context: Context | None = None,
        autostart: bool = True,
    ) -> None:
        """Made by `Node.create_timer`; the first call is one period from now.

        Raises:
            RCLError: a negative period, or after the shutdown.
        """
        if timer_period_ns < 0:
            raise RCLError(
                "failed to create timer: timer period must be non-negative, "
                f"at {timer_period_ns} ns"
            )
        self.node: Any = None
        self.callback, self.callback_group, self.clock = callback, callback_group, clock
        self.context = context or get_default_context()
        if not self.context.ok():
            raise RCLError("failed to create timer: the given context is not valid")
        self._period, self._cancelled, self._destroyed = timer_period_ns, not autostart, False
        self._last = clock.nanoseconds()
        self._next = self._last + timer_period_ns
        self._left_at_change: int | None = None
        self.queued = False
        """Whether an executor's thread is about to call it; until then it is not due again."""
        self._listener = JumpListener(_ANY_JUMP, self._before_jump, self._after_jump)
        clock.add_listener(self._listener)

    # For users.

    def _check(self) -> None:
        if self._destroyed:
            raise InvalidHandle("cannot use Destroyable because destruction was requested")

    @property
    def timer_period_ns(self) -> int:
        """The period [ns]; a new period is used after the next call."""
        self._check()
        return self._period

    @timer_period_ns.setter
    def timer_period_ns(self, value: float) -> None:
        self._check()
        self._period = int(value)

    def is_canceled(self) -> bool:
        """Whether the timer was cancelled."""
        self._check()
        return self._cancelled

    def cancel(self) -> None:
        """Stops calling until `reset`."""
        self._check()
        self._cancelled = True

    def reset(self) -> None:
        """Restarts the timer: the next call is one period from now."""
        self._check()
        self._next = self.clock.nanoseconds() + self._period
        self._cancelled = False
        self.requeue()

    def is_ready(self) -> bool:
        """Whether a call is due."""
        self._check()
        left = self.left()
        return left is not None and left <= 0

    def time_since_last_call(self) -> int:
        """Time since the last call, or since the start [ns]."""
        self._check()
        return self.clock.nanoseconds() - self._last

    def time_until_next_call(self) -> int | None:
        """Time until the next call on the timer's clock [ns]; None if it was cancelled."""
        self._check()
        return self.left()

    def drop_turn(self, executor: Any) -> None:
        """Does nothing: a timer is in no queue, the executor checks the time."""

    def destroy(self) -> None:
        """Ends it."""
        self._destroyed = True
        self.clock.remove_listener(self._listener)

    # For the executor.

    def left(self) -> int | None:
        """Time until the next call [ns]; None if there will be no call."""
        if self._cancelled or self._destroyed:
            return None
        return self._next - self.clock.nanoseconds()

    def take(self) -> tuple[()] | None:
        """Sets the time of the next call, without missed periods; None if cancelled."""
        if self._cancelled or self._destroyed:
            self.queued = False
            return None
        now, period = self.clock.nanoseconds(), self._period
        self._last = now
        self._next += period
        if self._next <= now:
            self._next = now + period - (now - self._next) % period if period else now
        if self.queued:  # the spinning thread has not considered the timer since then
            self.requeue()
        return ()

    def handle(self) -> Any:
        """Calls the callback."""
        return self.callback()

    def requeue(self) -> None:
        """Has the executor check the timer."""
        self.queued = False
        executor = self.node.executor if self.node is not None else None
        if executor is not None:
            executor.wake()

    # Jumps of the clock, as in rcl's timer.c: `_rcl_timer_time_jump`.

    def _before_jump(self, jump: TimeJump) -> None:
        now = self.clock.nanoseconds()
        if jump.clock_change != ClockChange.ROS_TIME_NO_CHANGE and now:
            self._left_at_change = self._next - now

    def _after_jump(self, jump: TimeJump) -> None:
        now = self.clock.nanoseconds()
        if jump.clock_change == ClockChange.ROS_TIME_NO_CHANGE:
            if now < self._last and self._next > now:
                self._last, self._next = now, now + self._period
        elif now and self._left_at_change:
            self._last = now - self._left_at_change
            self._next = self._last + self._period
            self._left_at_change = None
        self.requeue()


class Rate:
    """Sleeps until a timer fires."""

    def __init__(self, timer: Timer, *, context: Context) -> None:
        """Made by `Node.create_rate`."""
        self.timer, self._context = timer, context
        self._destroyed = self._fired = False
        self._lock = threading.Lock()
        self._sleepers: list[SimpleQueue[None]] = []
        timer.callback = self._fire
        context.wake_at_end(self)

    def _fire(self) -> None:
        with self._lock:
            self._fired = True
        self.wake()

    def wake(self) -> None:
        """Wakes all that sleep."""
        for sleeper in list(self._sleepers):
            sleeper.put(None)

    def destroy(self) -> None:
        """Wakes all sleeping threads; `sleep` raises RuntimeError afterwards."""
        self._destroyed = True
        self.wake()

    def sleep(self) -> None:
        """Waits until the timer fires, or returns if it has since the last sleep.

        Another thread must spin the node.

        Raises:
            ROSInterruptException: the context was shut down.
            RuntimeError: the rate was destroyed before.
        """
        if not self._context.ok():
            raise ROSInterruptException
        if self._destroyed:
            raise RuntimeError("Rate cannot sleep because it has been destroyed")
        sleeper: SimpleQueue[None] = SimpleQueue()
        self._sleepers.append(sleeper)
        try:
            while not self._fired and not self._destroyed and self._context.ok():
                sleeper.get()
        finally:
            with self._lock:
                self._sleepers.remove(sleeper)
                if not self._sleepers:
                    self._fired = False
        if not self._context.ok():
            raise ROSInterruptException
