"""Callback groups: what runs at the same time, and what never does."""

import threading
from functools import partial
from typing import Any

import pytest
from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from spinning import make, spin_until
from std_msgs.msg import String
from std_srvs.srv import Trigger


def both_run(first: Any, second: Any, node: Node, pool: MultiThreadedExecutor) -> bool:
    """Whether two callbacks, of these groups, are seen to run at the same time."""
    meeting = threading.Barrier(2)
    met: list[bool] = []

    def meet() -> None:
        try:
            meeting.wait(0.3)
            met.append(True)
        except threading.BrokenBarrierError:
            met.append(False)

    for group in (first, second):
        node.create_guard_condition(meet, group).trigger()
    assert spin_until(pool, lambda: len(met) == 2)
    return all(met)


def test_groups_decide_what_runs_at_the_same_time(executor: SingleThreadedExecutor) -> None:
    """Callbacks of two groups, and of one reentrant group, do; of one exclusive group do not."""
    pool = MultiThreadedExecutor(3)
    node = make(pool)
    exclusive, reentrant = MutuallyExclusiveCallbackGroup(), ReentrantCallbackGroup()
    assert both_run(exclusive, MutuallyExclusiveCallbackGroup(), node, pool)
    assert both_run(reentrant, reentrant, node, pool)
    assert both_run(exclusive, None, node, pool)
    assert not both_run(exclusive, exclusive, node, pool)
    assert not both_run(None, None, node, pool)
    pool.shutdown()


def test_an_exclusive_group_never_runs_two(executor: SingleThreadedExecutor) -> None:
    """Timers, subscriptions, services and guard conditions of one group take turns, all of them."""
    pool, group = MultiThreadedExecutor(4), MutuallyExclusiveCallbackGroup()
    node = make(pool)
    busy, overlaps, calls = threading.Lock(), [], dict.fromkeys("tsvg", 0)

    def work(name: str, *args: Any) -> Any:
        if not busy.acquire(blocking=False):
            overlaps.append(name)
            return args[-1] if args else None
        threading.Event().wait(0.001)
        calls[name] += 1
        busy.release()
        return args[-1] if args else None

    node.create_timer(0.01, partial(work, "t"), group)
    node.create_subscription(String, "x", partial(work, "s"), 10, callback_group=group)
    node.create_service(Trigger, "ask", partial(work, "v"), callback_group=group)
    guard = node.create_guard_condition(partial(work, "g"), group)
    publisher = node.create_publisher(String, "x", 10)
    client = node.create_client(Trigger, "ask", callback_group=ReentrantCallbackGroup())
    assert spin_until(pool, publisher.get_subscription_count)
    assert spin_until(pool, client.service_is_ready)

    def stir() -> None:
        guard.trigger()
        publisher.publish(String())
        client.call_async(Trigger.Request())

    node.create_timer(0.01, stir, ReentrantCallbackGroup())
    assert spin_until(pool, lambda: min(calls.values()) > 3)
    assert overlaps == []
    pool.shutdown()


def test_a_reentrant_callback_overlaps_itself(executor: SingleThreadedExecutor) -> None:
    """A timer and a subscription of a reentrant group are called again before they have ended."""
    pool, group = MultiThreadedExecutor(3), ReentrantCallbackGroup()
    node = make(pool)
    ticks, words = threading.Barrier(2), threading.Barrier(2)
    met: list[str] = []

    def meet(meeting: threading.Barrier, name: str, *_: Any) -> None:
        if name not in met:
            try:
                meeting.wait(5.0)
                met.append(name)
            except threading.BrokenBarrierError:
                pass

    timer = node.create_timer(0.005, partial(meet, ticks, "timer"), group)
    assert spin_until(pool, lambda: "timer" in met)
    timer.cancel()
    node.create_subscription(String, "x", partial(meet, words, "x"), 10, callback_group=group)
    publisher = node.create_publisher(String, "x", 10)
    assert spin_until(pool, publisher.get_subscription_count)
    publisher.publish(String())
    publisher.publish(String())
    assert spin_until(pool, lambda: "x" in met)
    pool.shutdown()


def test_a_group_may_span_nodes(executor: SingleThreadedExecutor) -> None:
    """Entities of two nodes in one exclusive group take turns, also on two executors."""
    group, order, gate = MutuallyExclusiveCallbackGroup(), [], threading.Event()
    pools = [MultiThreadedExecutor(2), MultiThreadedExecutor(2)]
    nodes = [make(pool, name) for pool, name in zip(pools, "ab", strict=True)]

    def first() -> None:
        order.append("begin")
        gate.wait(20.0)
        order.append("end")

    nodes[0].create_guard_condition(first, group).trigger()
    assert spin_until(pools[0], lambda: order == ["begin"])
    nodes[1].create_guard_condition(lambda: order.append("other"), group).trigger()
    timer = nodes[1].create_timer(0.001, lambda: (order.append("tick"), timer.cancel()), group)
    for _ in range(5):
        pools[1].spin_once(timeout_sec=0.01)
    assert order == ["begin"]
    gate.set()
    assert spin_until(pools[1], lambda: {"other", "tick"} <= set(order))
    assert order[:2] == ["begin", "end"]
    for pool in pools:
        pool.shutdown()


def test_groups_know_their_entities(executor: SingleThreadedExecutor) -> None:
    """Everything that has a callback belongs to its group, by default to the node's."""
    node, group = Node("tester"), ReentrantCallbackGroup()
    assert isinstance(node.default_callback_group, MutuallyExclusiveCallbackGroup)
    for chosen in (None, group):
        expected = chosen or node.default_callback_group
        for entity in (
            node.create_timer(1.0, lambda: None, chosen),
            node.create_subscription(String, "x", lambda _: None, 1, callback_group=chosen),
            node.create_service(Trigger, "~/s", lambda *_: _[1], callback_group=chosen),
            node.create_client(Trigger, "~/s", callback_group=chosen),
            node.create_guard_condition(lambda: None, chosen),
        ):
            assert entity.callback_group is expected
            assert expected.has_entity(entity)
    assert not group.has_entity(node.create_timer(1.0, lambda: None))


def test_an_exclusive_group_lets_one_in(executor: SingleThreadedExecutor) -> None:
    """Until it has ended no other begins, and it does not begin twice."""
    node, group = Node("tester"), MutuallyExclusiveCallbackGroup()
    one, two = (node.create_timer(1.0, lambda: None, group) for _ in range(2))
    assert group.can_execute(one)
    assert group.beginning_execution(one)
    assert not group.can_execute(two)
    assert not group.beginning_execution(two)
    assert not group.beginning_execution(one)
    group.ending_execution(one)
    assert group.beginning_execution(two)
    reentrant = ReentrantCallbackGroup()
    assert reentrant.beginning_execution(one)
    assert reentrant.beginning_execution(one)


class Pairs(CallbackGroup):
    """Lets callbacks in while the gate is open."""

    def __init__(self) -> None:
        super().__init__()
        self.open = False
        self.ended = 0

    def can_execute(self, entity: Any) -> bool:
        return self.open

    def beginning_execution(self, entity: Any) -> bool:
        return self.open

    def ending_execution(self, entity: Any) -> None:
        self.ended += 1


def test_a_group_of_ones_own_decides(executor: SingleThreadedExecutor) -> None:
    """Its answers count, and it hears of each end; the base class has no answer."""
    node, group, called = make(executor), Pairs(), []
    node.create_timer(0.001, lambda: called.append(1), group)
    for _ in range(5):
        executor.spin_once(timeout_sec=0.005)
    assert called == []
    group.open = True
    executor.wake()
    assert spin_until(executor, lambda: len(called) > 1)
    assert group.ended == len(called)
    for method in ("can_execute", "beginning_execution", "ending_execution"):
        with pytest.raises(NotImplementedError):
            getattr(CallbackGroup(), method)(None)
