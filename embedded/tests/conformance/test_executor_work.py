"""Executors: calls inside of callbacks, fairness, and executors of one's own."""

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import (
    Executor,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
    TimeoutException,
)
from rclpy.node import Node
from rclpy.task import Future
from spinning import make, spin_until
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

EXECUTORS = (SingleThreadedExecutor, partial(MultiThreadedExecutor, 3))
each_executor = pytest.mark.parametrize("kind", EXECUTORS, ids=("single", "multi"))


def triggered(node: Node, callback: Callable[[], Any], group: Any = None) -> Any:
    """A guard condition of the node that has been triggered."""
    guard = node.create_guard_condition(callback, group)
    guard.trigger()
    return guard


# Calls inside of callbacks.


def flip(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
    """The service of the tests below."""
    response.success = not request.data
    return response


def test_a_callback_may_await_a_service(executor: SingleThreadedExecutor) -> None:
    """With the client in another group one thread is enough."""
    node, answers = make(executor), []
    node.create_service(SetBool, "flip", flip, callback_group=ReentrantCallbackGroup())
    client = node.create_client(SetBool, "flip", callback_group=ReentrantCallbackGroup())
    assert spin_until(executor, client.service_is_ready)

    async def ask() -> None:
        answers.append((await client.call_async(SetBool.Request())).success)

    triggered(node, ask)
    assert spin_until(executor, lambda: answers == [True])


def test_a_callback_that_awaits_keeps_its_group_busy(executor: SingleThreadedExecutor) -> None:
    """So a service of the same group is awaited in vain."""
    node, answers, others = make(executor), [], []
    node.create_service(SetBool, "flip", flip, callback_group=ReentrantCallbackGroup())
    client = node.create_client(SetBool, "flip")
    assert spin_until(executor, client.service_is_ready)
    gate = Future()

    async def ask() -> None:
        future = client.call_async(SetBool.Request())
        await gate
        answers.append((future.done(), others[:]))

    triggered(node, ask)
    assert spin_until(executor, lambda: True)
    executor.spin_once(timeout_sec=0.05)
    node.create_timer(0.001, lambda: others.append(1))
    for _ in range(10):
        executor.spin_once(timeout_sec=0.01)
    gate.set_result(None)
    assert spin_until(executor, lambda: answers == [(False, [])])
    assert spin_until(executor, lambda: others)


def test_a_callback_may_block_for_a_service(executor: SingleThreadedExecutor) -> None:
    """With several threads and a reentrant group `call` in a callback gets its response."""
    pool, group, answers = MultiThreadedExecutor(4), ReentrantCallbackGroup(), []
    node = make(pool)
    node.create_service(SetBool, "flip", flip, callback_group=group)
    client = node.create_client(SetBool, "flip", callback_group=group)
    assert spin_until(pool, client.service_is_ready)

    def ask() -> None:
        answers.append(client.call(SetBool.Request(data=True), timeout_sec=8.0).success)

    triggered(node, ask, group)
    assert spin_until(pool, lambda: answers == [False])
    pool.shutdown()


def test_a_callback_may_spin_another_node(executor: SingleThreadedExecutor) -> None:
    """A call by another node completes inside of a callback, with rclpy's own executor."""
    node, helper, answers = Node("tester"), Node("helper"), []
    node.create_service(SetBool, "flip", flip, callback_group=ReentrantCallbackGroup())
    client = helper.create_client(SetBool, "flip")
    assert client.wait_for_service(20.0)

    def ask() -> None:
        future = client.call_async(SetBool.Request())
        rclpy.spin_until_future_complete(helper, future, timeout_sec=20.0)
        answers.append(future.result().success)
        rclpy.shutdown()

    triggered(node, ask)
    rclpy.spin(node)
    assert answers == [True]


# Fairness.


@each_executor
def test_a_late_timer_starves_nobody(executor: SingleThreadedExecutor, kind: Any) -> None:
    """Beside a timer of period zero other timers, messages and tasks come to their turn."""
    spinner, got = kind(), {"timer": 0, "message": 0, "busy": 0}
    node = make(spinner)

    def count(name: str, *_: Any) -> None:
        got[name] += 1

    node.create_timer(0.0, partial(count, "busy"))
    node.create_timer(0.001, partial(count, "timer"))
    node.create_subscription(String, "x", partial(count, "message"), 10)
    publisher = node.create_publisher(String, "x", 10)
    assert spin_until(spinner, publisher.get_subscription_count)
    publisher.publish(String())
    task = spinner.create_task(lambda: 1)
    assert spin_until(spinner, lambda: got["timer"] > 2 and got["message"] and task.done())
    assert got["busy"]
    spinner.shutdown()


@each_executor
def test_a_flood_starves_nobody(executor: SingleThreadedExecutor, kind: Any) -> None:
    """While messages keep coming, timers and services are served."""
    spinner, ticks = kind(), []
    node = make(spinner)
    publisher = node.create_publisher(String, "x", 100)
    node.create_subscription(String, "x", lambda m: publisher.publish(m), 100)
    node.create_timer(0.001, lambda: ticks.append(1))
    node.create_service(Trigger, "ask", lambda _, response: response)
    client = node.create_client(Trigger, "ask")
    assert spin_until(spinner, publisher.get_subscription_count)
    assert spin_until(spinner, client.service_is_ready)
    for _ in range(20):
        publisher.publish(String())
    future = client.call_async(Trigger.Request())
    assert spin_until(spinner, lambda: future.done() and len(ticks) > 3)
    spinner.shutdown()


# Executors of one's own.


class Patient(Executor):
    """Counts the callbacks that it runs."""

    def __init__(self) -> None:
        super().__init__()
        self.entities: list[Any] = []

    def spin_once(self, timeout_sec: float | None = None) -> None:
        try:
            handler, entity, _ = self.wait_for_ready_callbacks(timeout_sec=timeout_sec)
        except TimeoutException:
            return
        self.entities.append(entity)
        handler()


def test_an_executor_of_ones_own_gets_ready_callbacks(executor: SingleThreadedExecutor) -> None:
    """It learns the entity, and runs the callback itself."""
    mine, called = Patient(), []
    guard = triggered(make(mine), lambda: called.append(1))
    assert spin_until(mine, lambda: called)
    assert guard in mine.entities
    mine.shutdown()


def test_the_base_class_does_not_spin(executor: SingleThreadedExecutor) -> None:
    """A custom executor must define spin_once."""
    base = Executor()
    with pytest.raises(NotImplementedError):
        base.spin_once()
