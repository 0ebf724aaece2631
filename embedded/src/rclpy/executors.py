"""Executors: they wait for work and call the callbacks."""

from __future__ import annotations

import inspect
import math
import os
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from types import CoroutineType
from typing import Any, Self

from ros2_embedded.interrupts import signals_wait

from rclpy.context import Context, get_default_context
from rclpy.task import Future, Task
from rclpy.timer import Timer


def _deadline(timeout_sec: float | None) -> float | None:
    """The time at which a timeout ends; a negative timeout never ends."""
    if timeout_sec is None or timeout_sec < 0:
        return None
    return time.monotonic() + timeout_sec


async def await_or_execute(callback: Callable[..., Any], *args: Any) -> Any:
    """Awaits a coroutine function; calls any other function."""
    result = callback(*args)
    return await result if inspect.iscoroutinefunction(callback) else result


class ExternalShutdownException(Exception):
    """The context was shut down during a wait, for example by SIGTERM."""


class ShutdownException(Exception):
    """The executor was shut down during a wait."""


class TimeoutException(Exception):
    """There was no work until the timeout."""


class ConditionReachedException(Exception):
    """The condition that was waited for is met."""


class Executor:
    """Base of the executors: a queue of entities and tasks that have work, and the timers."""

    def __init__(self, *, context: Context | None = None) -> None:
        """Has no nodes yet; raises RCLError if the context is not initialised, or shut down."""
        super().__init__()
        self._context = context or get_default_context()
        self._nodes: dict[Any, Any] = {}
        """The nodes, and their handles."""
        self._queue: deque[Any] = deque()
        self._wait_set = self._context.new_wait_set()
        self._is_shutdown = False
        self._timer_was_last = False
        self._context.wake_at_end(self)

    def __enter__(self) -> Self:
        """The executor."""
        return self

    def __exit__(self, *_: object) -> None:
        """Shuts it down."""
        self.shutdown()

    @property
    def context(self) -> Context:
        """The context that it belongs to."""
        return self._context

    # Nodes.

    def add_node(self, node: Any) -> bool:
        """Adds a node; False if the executor has it already."""
        if node in self._nodes:
            return False
        with signals_wait():  # a node that it has in part would be deaf in part
            self._nodes[node] = node.handle
            node.executor = self
            for entity in node.handle.all_entities():
                self.watch(entity)
        self.wake()
        return True

    def remove_node(self, node: Any) -> None:
        """Removes a node: its callbacks are not called any more."""
        if node in self._nodes:
            with signals_wait():
                del self._nodes[node]
                for entity in node.handle.all_entities():
                    for source, _ in entity.sources:
                        self.forget(source)
        self.wake()

    def get_nodes(self) -> list[Any]:
        """The nodes."""
        return list(self._nodes)

    # Work.

    def watch(self, entity: Any) -> None:
        """Waits for samples of an entity of one of its nodes."""
        if entity.node in self._nodes:
            for source in entity.sources:
                self._wait_set.add(source)
            entity.wake()

    def forget(self, source: Any) -> None:
        """Stops waiting for a source of an entity."""
        self._wait_set.remove(source)

    def put(self, item: Any) -> None:
        """Queues an entity or a task; any thread may call it."""
        self._queue.append(item)
        self._wait_set.wake()

    def wake(self) -> None:
        """Wakes the executor, so that it checks its timers and the context."""
        self.put(None)

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Task:
        """Runs a function or a coroutine; returns the future of its result."""
        task = Task(callback, args, kwargs, executor=self)
        self.put(task)
        return task

    def can_execute(self, entity: Any) -> bool:
        """Whether the callback group of the entity allows its callback now."""
        return bool(entity.callback_group.can_execute(entity))

    def _next_timer(self) -> tuple[Any, float]:
        """The timer that is overdue the longest, or None and the time until the next is due [s]."""
        due, longest, wait = None, 1, math.inf
        for handle in list(self._nodes.values()):
            for timer in handle.timers:
                left = None if timer.queued else timer.left()
                if left is None:
                    continue
                if left > 0:
                    if not timer.clock.simulated:
                        wait = min(wait, left * 1e-9)
                elif not self.can_execute(timer):
                    timer.callback_group.park(timer)
                elif left < longest:
                    due, longest = timer, left
        return due, 0.0 if due is not None else wait

    def _next(self, deadline: float | None) -> Any:
        """Waits for an entity, a timer or a task; None after the timeout or a change of nodes."""
        timer, wait = self._next_timer()
        if deadline is not None:
            wait = min(wait, deadline - time.monotonic())
        self._wait_set.wait(wait, self._queue.__len__)
        # In turns: a timer that is always late must not block everything else.
        if timer is not None and (not self._timer_was_last or not self._queue):
            self._timer_was_last = True
            return timer
        self._timer_was_last = False
        try:
            while (item := self._queue.popleft()) is None:
                pass
        except IndexError:
            return None
        return item

    def _wait(self, timeout_sec: float | None, condition: Callable[[], bool] | None = None) -> Any:
        """Waits for an entity, a timer or a task.

        Raises:
            ShutdownException: the executor was shut down.
            ExternalShutdownException: the context was shut down.
            ConditionReachedException: The condition is met.
            TimeoutException: The timeout has ended.
        """
        deadline = None if timeout_sec is None else _deadline(timeout_sec)
        while True:
            if self._is_shutdown:
                raise ShutdownException
            if condition is not None and condition():
                raise ConditionReachedException
            item = self._next(deadline)
            if not self._context.ok() and not self._is_shutdown:
                raise ExternalShutdownException
            if isinstance(item, Task):
                return item
            if item is not None:
                item.drop_turn(self)  # now: if a signal's handler raises, there will be another
                if item.node in self._nodes:
                    return item
            elif deadline is not None and time.monotonic() >= deadline:
                raise TimeoutException

    def wait_for_ready_callbacks(
        self,
        timeout_sec: float | None = None,
        nodes: list[Any] | None = None,
        condition: Callable[[], bool] | None = None,
    ) -> tuple[Callable[[], None], Any, Any]:
        """For custom executors: the task that runs the next callback, its entity and its node.

        Raises what `_wait` does.
        """
        item = self._wait(timeout_sec, condition)
        run = lambda: self._run(item)  # noqa: E731
        return (run, None, None) if isinstance(item, Task) else (run, item, item.node)

    def _run(self, item: Any) -> None:
        """Runs one item; exceptions of a callback or of a task are raised."""
        if isinstance(item, Task):
            self._run_task(item)
            return
        group, coroutine = item.callback_group, None
        threads, me = self._context.in_callback, threading.get_ident()
        nested = me in threads
        if not group.beginning_execution(item):
            group.park(item)
            return
        try:
            threads.add(me)
            taken = item.take()
            result = None if taken is None else item.handle(*taken)
            if isinstance(result, CoroutineType) and inspect.iscoroutinefunction(item.callback):
                coroutine = self._to_the_end(result, item)
        finally:
            if coroutine is None:
                group.ending_execution(item)
                if group.parked:
                    group.unpark()
            if not nested:
                threads.discard(me)
                if self._context.leaves_after_callback:
                    self._context.leave()
        if coroutine is not None:
            self._run_task(Task(coroutine, executor=self))

    @staticmethod
    async def _to_the_end(coroutine: Any, item: Any) -> None:
        """Awaits a callback's coroutine; its group is busy until it ends."""
        try:
            await coroutine
        finally:
            item.callback_group.ending_execution(item)
            item.callback_group.unpark()

    @staticmethod
    def _run_task(task: Task) -> None:
        task()
        if task.done():
            task.result()

    # Spinning.

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Waits for one callback and runs it; custom executors define this method.

        Raises:
            ExternalShutdownException: the context was shut down.
        """
        self._spin_once(timeout_sec)

    def spin_once_until_future_complete(
        self, future: Future, timeout_sec: float | None = None
    ) -> None:
        """Waits for one callback and runs it, unless the future is done before."""
        future._add_waker(self.wake)
        try:
            self._spin_once(timeout_sec, future.done)
        finally:
            future._remove_waker(self.wake)

    def _spin_once(
        self, timeout_sec: float | None, condition: Callable[[], bool] | None = None
    ) -> None:
        raise NotImplementedError

    def spin(self) -> None:
        """Runs callbacks until the shutdown."""
        while self._context.ok() and not self._is_shutdown:
            self.spin_once()

    def spin_until_future_complete(self, future: Future, timeout_sec: float | None = None) -> None:
        """Runs callbacks until a future is done or the timeout has ended."""
        deadline, left = _deadline(timeout_sec), timeout_sec
        while self._context.ok() and not future.done() and not self._is_shutdown:
            self.spin_once_until_future_complete(future, left)
            if deadline is not None:
                left = deadline - time.monotonic()
                if left <= 0:
                    return

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Ends spinning and removes the nodes; does not wait for callbacks, as in rclpy."""
        self._is_shutdown = True
        self._nodes = {}
        self._wait_set.close()
        return True


class SingleThreadedExecutor(Executor):
    """Runs one callback at a time, in the thread that spins."""

    def _spin_once(
        self, timeout_sec: float | None, condition: Callable[[], bool] | None = None
    ) -> None:
        try:
            item = self._wait(timeout_sec, condition)
        except (ShutdownException, TimeoutException, ConditionReachedException):
            return
        self._run(item)


class MultiThreadedExecutor(Executor):
    """Runs callbacks in a pool of threads, as their groups allow."""

    def __init__(self, num_threads: int | None = None, *, context: Context | None = None) -> None:
        """Starts the pool; by default it has as many threads as there are processors."""
        super().__init__(context=context)
        if num_threads is None:
            num_threads = len(os.sched_getaffinity(0))
        if num_threads == 1:
            warnings.warn(
                "MultiThreadedExecutor is used with a single thread.\n"
                "Use the SingleThreadedExecutor instead.",
                stacklevel=2,
            )
        self._pool = ThreadPoolExecutor(num_threads, thread_name_prefix="executor")
        self._errors: SimpleQueue[BaseException] = SimpleQueue()

    def _spin_once(
        self, timeout_sec: float | None, condition: Callable[[], bool] | None = None
    ) -> None:
        try:
            item = self._wait(
                timeout_sec,
                lambda: not self._errors.empty() or (condition is not None and condition()),
            )
        except (ExternalShutdownException, ShutdownException):
            return
        except (TimeoutException, ConditionReachedException):
            item = None
        if item is not None:
            self._start(item)
        if not self._errors.empty():
            raise self._errors.get()

    def _start(self, item: Any) -> None:
        if not isinstance(item, Task):
            if not self.can_execute(item):
                item.callback_group.park(item)
                return
            if isinstance(item, Timer):
                item.queued = True
        try:
            self._pool.submit(self._work, item)
        except RuntimeError:  # a callback has shut the executor down
            if not self._is_shutdown:
                raise

    def _work(self, item: Any) -> None:
        try:
            self._run(item)
        except BaseException as error:
            self._errors.put(error)
            self.wake()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Ends spinning and the pool; does not wait for callbacks, as in rclpy."""
        done = super().shutdown(timeout_sec)
        self._pool.shutdown(wait=False, cancel_futures=True)
        return done
