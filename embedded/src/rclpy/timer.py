"""Timers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock
from rclpy.exceptions import RCLError


class Timer:
    """Calls a function again and again."""

    def __init__(
        self,
        node: Any,
        period_ns: int,
        callback: Callable[[], Any],
        group: CallbackGroup | None,
        clock: Clock,
    ) -> None:
        """Made by `Node.create_timer`; the first call is one period from now."""
        if period_ns < 0:
            raise RCLError(f"timer period must be non-negative: {period_ns} ns")
        self.node, self.callback, self.clock = node, callback, clock
        self.callback_group = group or node.default_callback_group
        self.timer_period_ns = period_ns
        self._cancelled = False
        self._last = clock.nanoseconds()
        self._next = self._last + period_ns
        self.running = False

    def is_canceled(self) -> bool:
        """Whether it was cancelled."""
        return self._cancelled

    def cancel(self) -> None:
        """Stops calling until `reset`."""
        self._cancelled = True

    def reset(self) -> None:
        """Starts anew: the next call is one period from now."""
        self._cancelled = False
        self._next = self.clock.nanoseconds() + self.timer_period_ns
        if self.node.executor is not None:
            self.node.executor.wake()

    def is_ready(self) -> bool:
        """Whether a call is due."""
        return not self._cancelled and self.time_until_next_call() <= 0

    def time_since_last_call(self) -> int:
        """Since the last call, or the start [ns]."""
        return self.clock.nanoseconds() - self._last

    def time_until_next_call(self) -> int:
        """Until the next call on the timer's clock [ns]."""
        left = self._next - self.clock.nanoseconds()
        if left > self.timer_period_ns:  # the clock was set back, as a simulation's is by a reset
            self._next -= left - self.timer_period_ns
            left = self.timer_period_ns
        return left

    def turn(self) -> Any:
        """Sets the next call's time and calls; periods that were missed are left out."""
        now, period = self.clock.nanoseconds(), self.timer_period_ns
        self._last = now
        self._next += period
        if self._next <= now:
            self._next = now + period - (now - self._next) % period if period else now
        return None if self._cancelled else self.callback()

    def drop_turn(self, executor: Any) -> None:
        """The executor does not own the node any more."""

    def destroy(self) -> None:
        """Ends it."""
        self.cancel()
