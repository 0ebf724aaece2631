"""Executors: their nodes, spinning, tasks, errors, and the order of things."""

import gc
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import (
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.task import Future
from spinning import make, result, spin_until
from std_msgs.msg import String

EXECUTORS = (SingleThreadedExecutor, partial(MultiThreadedExecutor, 3))
each_executor = pytest.mark.parametrize("kind", EXECUTORS, ids=("single", "multi"))


def triggered(node: Node, callback: Callable[[], Any], group: Any = None) -> Any:
    """A guard condition of the node that has been triggered."""
    guard = node.create_guard_condition(callback, group)
    guard.trigger()
    return guard


def in_thread(work: Callable[[], Any]) -> tuple[threading.Thread, list[BaseException]]:
    """Starts a thread; what it raises is in the list when it has ended."""
    errors: list[BaseException] = []

    def run() -> None:
        try:
            work()
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread, errors


# Nodes.


def test_a_node_has_one_executor(executor: SingleThreadedExecutor) -> None:
    """Adding tells whether it was new, another executor takes the node over, and it stays known."""
    node, other = Node("mover"), SingleThreadedExecutor()
    assert node.executor is None
    assert executor.add_node(node)
    assert not executor.add_node(node)
    assert node.executor is executor
    assert other.add_node(node)
    assert executor.get_nodes() == []
    assert other.get_nodes() == [node]
    assert node.executor is other
    other.remove_node(node)
    other.remove_node(node)
    assert other.get_nodes() == []
    assert node.executor is other
    node.executor = executor
    assert executor.get_nodes() == [node]
    node.executor = None
    assert executor.get_nodes() == []


def test_an_executor_is_not_kept_alive_by_its_node(executor: SingleThreadedExecutor) -> None:
    """A node knows its executor weakly."""
    node, short = Node("tester"), SingleThreadedExecutor()
    short.add_node(node)
    del short
    gc.collect()
    assert node.executor is None


def test_a_context_manager_shuts_the_executor_down(executor: SingleThreadedExecutor) -> None:
    """After the block it has no nodes, and spins no more."""
    called: list[int] = []
    with SingleThreadedExecutor() as mine:
        node = make(mine)
        triggered(node, lambda: called.append(1))
        assert spin_until(mine, lambda: called)
    assert mine.get_nodes() == []
    mine.spin_once()
    mine.spin()
    assert mine.shutdown()


def test_what_waited_moves_with_its_node(executor: SingleThreadedExecutor) -> None:
    """A message that came under one executor is handled by the next, and only there."""
    node, got = make(executor), []
    node.create_subscription(String, "x", lambda m: got.append(m.data), 10)
    publisher = node.create_publisher(String, "x", 10)
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String(data="one"))
    publisher.wait_for_all_acked()
    other = SingleThreadedExecutor()
    other.add_node(node)
    executor.spin_once(timeout_sec=0.0)
    assert got == []
    assert spin_until(other, lambda: got == ["one"])


@each_executor
def test_several_nodes_share_an_executor(executor: SingleThreadedExecutor, kind: Any) -> None:
    """Each node's callbacks are called; a node that is removed has no more calls."""
    spinner, calls = kind(), {"a": 0, "b": 0}

    def count(name: str) -> None:
        calls[name] += 1

    nodes = [make(spinner, name) for name in calls]
    for node in nodes:
        node.create_timer(0.001, partial(count, node.get_name()))
    assert spin_until(spinner, lambda: min(calls.values()) > 3)
    spinner.remove_node(nodes[0])
    for _ in range(5):
        spinner.spin_once(timeout_sec=0.01)
    rest = calls["a"]
    then = calls["b"]
    assert spin_until(spinner, lambda: calls["b"] > then + 3)
    assert calls["a"] == rest
    spinner.shutdown()


# Spinning.


def test_spin_once_runs_one_callback(executor: SingleThreadedExecutor) -> None:
    """Of two that are due it runs one; without any it returns after its time."""
    node, called = make(executor), []
    for name in "ab":
        triggered(node, partial(called.append, name))
    assert spin_until(executor, lambda: called)
    assert len(called) == 1
    assert spin_until(executor, lambda: len(called) == 2)
    executor.spin_once(timeout_sec=0.0)
    executor.spin_once(timeout_sec=0.01)
    assert sorted(called) == ["a", "b"]


def test_an_executor_may_have_nodes_of_several_contexts(executor: SingleThreadedExecutor) -> None:
    """As a bridge between two domains has."""
    other = Context()
    rclpy.init(args=[], context=other)
    node, guest = make(executor), make(executor, "guest", context=other)
    got: list[str] = []
    guest.create_subscription(String, "x", lambda m: got.append(m.data), 10)
    publisher = node.create_publisher(String, "x", 10)
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String(data="hello"))
    assert spin_until(executor, lambda: got == ["hello"])
    guest.destroy_node()
    rclpy.shutdown(context=other)
    timer_calls: list[None] = []
    node.create_timer(0.001, lambda: timer_calls.append(None))
    assert spin_until(executor, lambda: len(timer_calls) > 2)


def test_spin_once_finds_what_has_come(executor: SingleThreadedExecutor) -> None:
    """A message that is there is handled, without a wait for it."""
    node = make(executor)
    got: list[str] = []
    node.create_subscription(String, "x", lambda m: got.append(m.data), 3)
    publisher = node.create_publisher(String, "x", 3)
    assert spin_until(executor, lambda: publisher.get_subscription_count() == 1)
    publisher.publish(String(data="now"))
    publisher.wait_for_all_acked()
    for _ in range(10):  # what woke the executor before takes a turn
        executor.spin_once(timeout_sec=0.0)
    assert got == ["now"]


def test_a_trigger_before_the_executor_counts_once(executor: SingleThreadedExecutor) -> None:
    """A guard condition remembers that it was triggered, not how often."""
    node, called = Node("tester"), []
    guard = node.create_guard_condition(lambda: called.append(1))
    guard.trigger()
    guard.trigger()
    executor.add_node(node)
    assert spin_until(executor, lambda: called)
    for _ in range(3):
        executor.spin_once(timeout_sec=0.01)
    assert called == [1]
    assert node.destroy_guard_condition(guard)
    assert not node.destroy_guard_condition(guard)


def test_spinning_for_a_future_has_a_limit(executor: SingleThreadedExecutor) -> None:
    """It ends when the future is done, from whichever thread, or when the time is over."""
    future = Future()
    executor.spin_until_future_complete(future, timeout_sec=0.0)
    executor.spin_until_future_complete(future, timeout_sec=0.01)
    executor.spin_once_until_future_complete(future, timeout_sec=0.01)
    assert not future.done()
    thread, _ = in_thread(lambda: future.set_result(7))
    executor.spin_until_future_complete(future)
    thread.join()
    assert future.result() == 7
    executor.spin_until_future_complete(future)
    executor.spin_once_until_future_complete(future)


def test_spin_takes_the_node_away_at_its_end(executor: SingleThreadedExecutor) -> None:
    """rclpy.spin_once takes the node from its executor; with a future, if it was not there."""
    node = make(executor)
    rclpy.spin_once(node, timeout_sec=0.0)
    assert node.executor is rclpy.get_global_executor()
    assert executor.get_nodes() == rclpy.get_global_executor().get_nodes() == []
    executor.add_node(node)
    rclpy.spin_until_future_complete(node, Future(), executor, timeout_sec=0.0)
    assert executor.get_nodes() == [node]
    rclpy.spin_until_future_complete(node, Future(), timeout_sec=0.0)
    assert executor.get_nodes() == []


def test_spin_returns_when_a_callback_shuts_down(executor: SingleThreadedExecutor) -> None:
    """rclpy.shutdown() in a callback ends rclpy.spin without an error."""
    node = Node("tester")
    triggered(node, rclpy.shutdown)
    rclpy.spin(node)
    assert not rclpy.ok()


@each_executor
def test_an_executor_can_be_shut_down_by_a_callback(
    executor: SingleThreadedExecutor, kind: Any
) -> None:
    """spin() returns, the context lives on."""
    spinner = kind()
    triggered(make(spinner), spinner.shutdown)
    spinner.spin()
    assert rclpy.ok()
    assert spinner.get_nodes() == []


def test_a_shutdown_elsewhere_ends_spin(executor: SingleThreadedExecutor) -> None:
    """rclpy.spin returns; an executor of one's own that waits is told by an exception."""
    called = threading.Event()
    node, other = Node("tester"), make(executor, "other")
    triggered(node, called.set)
    quiet, quiet_errors = in_thread(lambda: rclpy.spin(node))
    spun = threading.Event()
    triggered(other, spun.set)
    loud, loud_errors = in_thread(executor.spin)
    assert called.wait(20.0)
    assert spun.wait(20.0)
    time.sleep(0.1)  # ROS 2's executor may use what a shutdown destroys, if it is not waiting
    rclpy.shutdown()
    for thread in (quiet, loud):
        thread.join(20.0)
        assert not thread.is_alive()
    assert quiet_errors == []
    # Between two waits it sees the end without an exception.
    assert all(isinstance(error, ExternalShutdownException) for error in loud_errors)


def test_many_threads_end_quietly_with_the_context(executor: SingleThreadedExecutor) -> None:
    """spin() of a MultiThreadedExecutor returns when the context is shut down."""
    spinner, called = MultiThreadedExecutor(2), threading.Event()
    triggered(make(spinner), called.set)
    thread, errors = in_thread(spinner.spin)
    assert called.wait(20.0)
    rclpy.shutdown()
    thread.join(20.0)
    assert not thread.is_alive()
    assert errors == []


def test_one_thread_is_warned_of(executor: SingleThreadedExecutor) -> None:
    """A MultiThreadedExecutor of one thread makes no sense."""
    with pytest.warns(UserWarning, match="SingleThreadedExecutor"):
        MultiThreadedExecutor(1).shutdown()


# Tasks.


@each_executor
def test_tasks_run_functions_and_coroutines(executor: SingleThreadedExecutor, kind: Any) -> None:
    """Arguments go in, results come out, in the order of finishing."""
    spinner, gate = kind(), Future()

    def add(a: int, b: int = 0) -> int:
        return a + b

    async def later(a: int) -> int:
        return a + await gate

    first = spinner.create_task(later, 1)
    second = spinner.create_task(add, 2, b=3)
    third = spinner.create_task(later(10))
    assert spin_until(spinner, second.done)
    assert second.result() == 5
    for _ in range(3):
        spinner.spin_once(timeout_sec=0.01)
    assert not first.done()
    gate.set_result(100)
    assert spin_until(spinner, lambda: first.done() and third.done())
    assert (first.result(), third.result()) == (101, 110)
    spinner.shutdown()


@each_executor
def test_errors_come_out_of_spin(executor: SingleThreadedExecutor, kind: Any) -> None:
    """What callbacks and tasks raise, spin raises; the executor goes on, tasks keep the error."""
    spinner = kind()
    node = make(spinner)
    # The errors of a pool come out when there is more to do.
    node.create_timer(0.01, lambda: None, ReentrantCallbackGroup())

    timers: list[Any] = []
    told: list[str] = []

    def fail(name: str) -> None:
        for timer in timers:
            timer.cancel()
        raise KeyError(name)

    async def fail_later(name: str) -> None:
        fail(name)

    def await_error(name: str) -> None:
        told.append(name)
        while True:
            with pytest.raises(KeyError) as caught:
                spin_until(spinner, lambda: False)
            if caught.value.args == (name,):
                return
            assert caught.value.args[0] in told  # ROS 2's pool may tell an error twice

    for callback in (fail, fail_later):
        names = [f"{callback.__name__} in a {kind}" for kind in ("task", "guard", "timer")]
        task = spinner.create_task(callback, names[0])
        await_error(names[0])
        assert task.exception().args == (names[0],)
        guard = triggered(node, partial(callback, names[1]))
        await_error(names[1])
        node.destroy_guard_condition(guard)
        timers.append(node.create_timer(0.02, partial(callback, names[2])))
        await_error(names[2])
    assert spinner.get_nodes() == [node]
    spinner.shutdown()


def test_only_coroutine_functions_are_awaited(executor: SingleThreadedExecutor) -> None:
    """A plain function that returns a coroutine is none: a task gives the coroutine back."""

    async def work() -> int:
        return 3

    task = executor.create_task(lambda: work())
    coroutine = result(executor, task)
    with pytest.raises(StopIteration):
        coroutine.send(None)
