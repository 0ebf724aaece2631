"""Timers and rates."""

import threading
import time
from typing import Any

import pytest
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle, ROSInterruptException
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.timer import Rate, Timer
from spinning import make, spin_until

LONG = 1000.0
"""A period that no test lives to see [s]."""


def test_a_timer_calls_again_and_again(executor: SingleThreadedExecutor) -> None:
    """The first call is one period after the start; the node lists its timers."""
    node, calls = make(executor), []
    timer = node.create_timer(0.01, lambda: calls.append(time.monotonic()))
    start = time.monotonic()
    assert isinstance(timer, Timer)
    assert timer in list(node.timers)
    assert timer.timer_period_ns == 10_000_000
    assert spin_until(executor, lambda: len(calls) > 2)
    assert calls[0] - start > 0.009


@pytest.mark.parametrize("period", [-1.0, -1e-9])
def test_a_negative_period_is_refused(executor: SingleThreadedExecutor, period: float) -> None:
    """It is an error of type RuntimeError."""
    node = Node("tester")
    before = list(node.timers)
    with pytest.raises(RuntimeError, match="timer"):
        node.create_timer(period, lambda: None)
    assert list(node.timers) == before


def test_a_cancelled_timer_is_silent_until_its_reset(executor: SingleThreadedExecutor) -> None:
    """It is not ready, has no next call, and starts anew with `reset`."""
    node, calls = make(executor), []
    timer = node.create_timer(0.005, lambda: calls.append(1))
    assert not timer.is_canceled()
    timer.cancel()
    assert timer.is_canceled()
    assert not timer.is_ready()
    assert timer.time_until_next_call() is None
    time.sleep(0.01)
    executor.spin_once(timeout_sec=0.02)
    assert not timer.is_ready()
    assert calls == []
    timer.reset()
    assert not timer.is_canceled()
    assert spin_until(executor, lambda: calls)


def test_a_timer_may_be_made_to_start_later(executor: SingleThreadedExecutor) -> None:
    """autostart=False: it waits for `reset`."""
    node, calls = make(executor), []
    timer = node.create_timer(0.001, lambda: calls.append(1), autostart=False)
    assert timer.is_canceled()
    time.sleep(0.005)
    executor.spin_once(timeout_sec=0.01)
    assert calls == []
    timer.reset()
    assert spin_until(executor, lambda: calls)


def test_a_reset_wakes_the_executor(executor: SingleThreadedExecutor) -> None:
    """Also of another thread, while nothing else is to be waited for."""
    node = make(executor)
    timer = node.create_timer(0.01, lambda: rclpy.shutdown(), autostart=False)
    threading.Timer(0.05, timer.reset).start()
    executor.spin()
    assert not rclpy.ok()


def test_a_timer_tells_its_times(executor: SingleThreadedExecutor) -> None:
    """Until the next and since the last call; a call and a reset set them."""
    node, calls = make(executor), []
    timer = node.create_timer(LONG, lambda: calls.append(1))
    period = timer.timer_period_ns
    assert 0 < timer.time_until_next_call() <= period
    assert 0 <= timer.time_since_last_call() < period
    time.sleep(0.002)
    first = timer.time_until_next_call()
    assert first <= period - 2_000_000
    since = timer.time_since_last_call()
    timer.reset()
    assert timer.time_until_next_call() > first
    assert timer.time_since_last_call() >= since  # a reset is no call
    quick = node.create_timer(0.05, lambda: calls.append(quick.time_since_last_call()))
    assert not quick.is_ready()
    time.sleep(0.06)
    assert quick.is_ready()
    assert quick.time_until_next_call() <= 0
    assert spin_until(executor, lambda: calls)
    assert calls[0] < 50_000_000


def test_a_new_period_counts_from_the_next_call_on(executor: SingleThreadedExecutor) -> None:
    """Setting it leaves the call that is due next; `reset` uses it at once."""
    node, calls = make(executor), []
    timer = node.create_timer(LONG, lambda: calls.append(1))
    timer.timer_period_ns = 1_000_000.7
    assert timer.timer_period_ns == 1_000_000
    assert timer.time_until_next_call() > 1_000_000_000
    timer.reset()
    assert spin_until(executor, lambda: len(calls) > 1)
    timer.timer_period_ns = int(LONG * 1e9)
    assert spin_until(executor, lambda: timer.time_until_next_call() > 1_000_000_000)


def test_missed_periods_are_left_out(executor: SingleThreadedExecutor) -> None:
    """A timer that is late by several periods is called once, and then in its old beat."""
    node, calls = make(executor), []
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    timer = node.create_timer(0.1, lambda: calls.append(clock.now().nanoseconds), clock=clock)
    due = clock.now().nanoseconds + timer.time_until_next_call()
    time.sleep(0.35)
    assert spin_until(executor, lambda: len(calls) == 1)
    left = (clock.now().nanoseconds + timer.time_until_next_call() - due) % 100_000_000
    assert min(left, 100_000_000 - left) < 10_000_000


def test_the_period_zero_is_always_ready(executor: SingleThreadedExecutor) -> None:
    """Each turn of the executor calls it."""
    node, calls = make(executor), []
    timer = node.create_timer(0.0, lambda: calls.append(1))
    assert timer.is_ready()
    assert spin_until(executor, lambda: len(calls) > 10)
    assert timer.is_ready()


def test_a_destroyed_timer_cannot_be_used(executor: SingleThreadedExecutor) -> None:
    """It is out of the node, and says so when asked."""
    node, calls = make(executor), []
    timer = node.create_timer(0.001, lambda: calls.append(1))
    assert node.destroy_timer(timer)
    assert not node.destroy_timer(timer)
    assert timer not in list(node.timers)
    timer.destroy()
    for use in (timer.is_ready, timer.is_canceled, timer.cancel, timer.reset,
                timer.time_since_last_call, timer.time_until_next_call):  # fmt: skip
        with pytest.raises(InvalidHandle):
            use()
    time.sleep(0.005)
    executor.spin_once(timeout_sec=0.0)
    assert calls == []


def test_a_timer_may_end_itself(executor: SingleThreadedExecutor) -> None:
    """Destroyed or cancelled by its own callback it is not called again."""
    node, calls = make(executor), []

    def destroy() -> None:
        calls.append("destroy")
        node.destroy_timer(timers[0])

    def cancel() -> None:
        calls.append("cancel")
        timers[1].cancel()

    timers = [node.create_timer(0.001, callback) for callback in (destroy, cancel)]
    assert spin_until(executor, lambda: len(calls) == 2)
    for _ in range(5):
        executor.spin_once(timeout_sec=0.005)
    assert sorted(calls) == ["cancel", "destroy"]


def test_a_callback_may_be_replaced(executor: SingleThreadedExecutor) -> None:
    """The attribute `callback` is what is called."""
    node, calls = make(executor), []
    timer = node.create_timer(0.001, lambda: calls.append("old"))
    timer.callback = lambda: calls.append("new")
    assert spin_until(executor, lambda: calls)
    assert set(calls) == {"new"}


def test_a_coroutine_is_not_called_while_it_awaits(executor: SingleThreadedExecutor) -> None:
    """The next call of a timer comes after the end of the one before."""
    node, log, gate = make(executor), [], rclpy.Future()

    async def work() -> None:
        log.append("begin")
        await gate
        log.append("end")

    node.create_timer(0.001, work)
    assert spin_until(executor, lambda: log)
    for _ in range(5):
        executor.spin_once(timeout_sec=0.005)
    assert log == ["begin"]
    gate.set_result(None)
    assert spin_until(executor, lambda: log[:3] == ["begin", "end", "begin"])


@pytest.mark.parametrize("kind", [ClockType.SYSTEM_TIME, ClockType.STEADY_TIME, ClockType.ROS_TIME])
def test_timers_run_on_any_clock(executor: SingleThreadedExecutor, kind: ClockType) -> None:
    """The clock that they are given is theirs."""
    node, calls = make(executor), []
    clock = Clock(clock_type=kind)
    timer = node.create_timer(0.001, lambda: calls.append(1), None, clock)
    assert timer.clock is clock
    assert spin_until(executor, lambda: len(calls) > 1)


# Rates.


@pytest.fixture
def spun(executor: SingleThreadedExecutor) -> Any:
    """A node that another thread spins."""
    node, pool = Node("tester"), MultiThreadedExecutor(2)
    pool.add_node(node)
    thread = threading.Thread(target=pool.spin, daemon=True)
    thread.start()
    yield node
    rclpy.try_shutdown()
    thread.join(20.0)
    assert not thread.is_alive()


def test_a_rate_sleeps_until_its_timer_fires(spun: Node) -> None:
    """The node makes it, from a frequency that is positive."""
    rate = spun.create_rate(20.0)
    assert isinstance(rate, Rate)
    rate.sleep()
    start = time.monotonic()
    for _ in range(3):
        rate.sleep()
    assert time.monotonic() - start > 0.09
    for frequency in (0.0, -1.0):
        with pytest.raises(ValueError, match="frequency"):
            spun.create_rate(frequency)


def test_a_rate_that_is_late_does_not_wait(spun: Node) -> None:
    """If its timer has fired since the last sleep it returns at once."""
    rate = spun.create_rate(100.0)
    slow = spun.create_rate(0.001)
    time.sleep(0.05)
    rate.sleep()
    sleeper = threading.Thread(target=slow.sleep, daemon=True)
    sleeper.start()
    time.sleep(0.02)
    assert sleeper.is_alive()
    assert spun.destroy_rate(slow)
    sleeper.join(20.0)
    assert not sleeper.is_alive()


def test_a_rate_wakes_all_that_sleep(spun: Node) -> None:
    """Several threads may share one."""
    rate = spun.create_rate(20.0)
    sleepers = [threading.Thread(target=rate.sleep, daemon=True) for _ in range(3)]
    for sleeper in sleepers:
        sleeper.start()
    for sleeper in sleepers:
        sleeper.join(20.0)
        assert not sleeper.is_alive()


def test_a_destroyed_rate_cannot_sleep(spun: Node) -> None:
    """The second destruction finds nothing."""
    rate = spun.create_rate(100.0)
    assert spun.destroy_rate(rate)
    assert not spun.destroy_rate(rate)
    with pytest.raises(RuntimeError, match="destroyed"):
        rate.sleep()


def test_the_shutdown_interrupts_a_rate(spun: Node) -> None:
    """A sleep in another thread raises, and so does the next one."""
    rate, errors, asleep = spun.create_rate(0.001), [], threading.Event()

    def sleep() -> None:
        asleep.set()
        try:
            rate.sleep()
        except ROSInterruptException as error:
            errors.append(error)

    thread = threading.Thread(target=sleep, daemon=True)
    thread.start()
    assert asleep.wait(20.0)
    time.sleep(0.02)
    rclpy.shutdown()
    thread.join(20.0)
    assert len(errors) == 1
    with pytest.raises(ROSInterruptException):
        rate.sleep()
