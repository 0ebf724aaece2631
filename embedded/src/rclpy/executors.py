"""Executors: they wait for work and call the callbacks."""

from __future__ import annotations

import inspect
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from queue import Empty, SimpleQueue
from typing import Any

from rclpy.context import Context, get_default_context
from rclpy.task import Future, Task

_FOREVER = 1e9


def _deadline(timeout_sec: float | None) -> float | None:
    """When a timeout is over; a negative one never is."""
    if timeout_sec is None or timeout_sec < 0:
        return None
    return time.monotonic() + timeout_sec


class ExternalShutdownException(Exception):
    """The context was shut down while something waited, as by SIGTERM."""


class ShutdownException(Exception):
    """The executor was shut down while something waited."""


class TimeoutException(Exception):
    """There was no work in time."""


class Executor:
    """Base of the executors: a queue of entities and tasks with something to do, and timers."""

    def __init__(self, *, context: Context | None = None) -> None:
        """Has no nodes yet."""
        self._context = context or get_default_context()
        self._nodes: list[Any] = []
        self._queue: SimpleQueue[Any] = SimpleQueue()
        self._shut_down = False
        self._timer_was_last = False
        self._context.executors.add(self)

    @property
    def context(self) -> Context:
        """The context that it belongs to."""
        return self._context

    # Nodes.

    def add_node(self, node: Any) -> bool:
        """Takes over a node's callbacks; False if it has the node already."""
        if node in self._nodes:
            return False
        if node.executor is not None:
            node.executor.remove_node(node)
        self._nodes.append(node)
        node.executor = self
        for entity in list(node.handle.entities):
            entity.wake()
        self.wake()
        return True

    def remove_node(self, node: Any) -> None:
        """Gives a node back."""
        if node in self._nodes:
            self._nodes.remove(node)
            node.executor = None

    def get_nodes(self) -> list[Any]:
        """The nodes."""
        return list(self._nodes)

    # Work.

    def put(self, item: Any) -> None:
        """Queues an entity or a task; any thread may call it."""
        self._queue.put(item)

    def wake(self) -> None:
        """Has the executor look around: at the timers, at the context."""
        self._queue.put(None)

    wake_task = put

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Task:
        """Runs a function or a coroutine; returns the future of its result."""
        task = Task(callback, args, kwargs, executor=self)
        self.put(task)
        return task

    def _next_timer(self) -> tuple[Any, float]:
        """A timer that is due, or None and the time until one may be [s]."""
        wait = _FOREVER
        for node in self._nodes:
            for timer in node.handle.timers:
                if timer.is_canceled() or timer.running:
                    continue
                left = timer.time_until_next_call()
                if left <= 0:
                    return timer, 0.0
                if not timer.clock.simulated:
                    wait = min(wait, left * 1e-9)
        return None, wait

    def _next(self, deadline: float | None) -> Any:
        """Waits for an entity, a timer or a task; None if none came, or something changed."""
        timer, wait = self._next_timer()
        if deadline is not None:
            wait = min(wait, deadline - time.monotonic())
        if wait <= 0:
            self._context.poll()
        # They take turns: a timer that is always late must not keep all else waiting.
        if timer is not None and (not self._timer_was_last or self._queue.empty()):
            self._timer_was_last = True
            return timer
        self._timer_was_last = False
        try:
            if wait <= 0:
                return self._queue.get_nowait()
            return self._queue.get(timeout=min(wait, threading.TIMEOUT_MAX))
        except Empty:
            return None

    def _wait(self, timeout_sec: float | None) -> Any:
        deadline = _deadline(timeout_sec)
        while True:
            item = self._next(deadline)
            if not self._context.ok():
                raise ExternalShutdownException
            if self._shut_down:
                raise ShutdownException
            if item is not None:
                if not isinstance(item, Task) and item.node.executor is not self:
                    item.drop_turn(self)
                    continue
                return item
            if deadline is not None and time.monotonic() >= deadline:
                return self._next_timer()[0]

    def _run(self, item: Any) -> None:
        """Runs one item; an exception of a callback or of a task comes out."""
        if isinstance(item, Task):
            item.step()
            self._raise_from(item)
            return
        result = item.turn()
        if inspect.iscoroutine(result):
            task = Task(result, executor=self)
            task.step()
            self._raise_from(task)

    @staticmethod
    def _raise_from(task: Task) -> None:
        if task.done() and task.exception() is not None:
            task.result()

    def _execute(self, item: Any) -> None:
        self._run(item)

    # Spinning.

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Waits for one callback and runs it.

        Raises:
            ExternalShutdownException: the context was shut down.
        """
        item = self._wait(timeout_sec)
        if item is not None:
            self._execute(item)

    def spin(self) -> None:
        """Runs callbacks until the shutdown."""
        while self._context.ok() and not self._shut_down:
            self.spin_once()

    def spin_until_future_complete(self, future: Future, timeout_sec: float | None = None) -> None:
        """Runs callbacks until a future is done or the time is over."""

        def wake(_: Future) -> None:
            self.wake()

        future.add_done_callback(wake)
        try:
            self._spin_until(future.done, timeout_sec)
        finally:
            future.remove_done_callback(wake)

    def _spin_until(self, done: Callable[[], bool], timeout_sec: float | None) -> None:
        deadline = _deadline(timeout_sec)
        while self._context.ok() and not self._shut_down and not done():
            item = self._next(deadline)
            if not self._context.ok():
                raise ExternalShutdownException
            if item is not None:
                if isinstance(item, Task) or item.node.executor is self:
                    self._execute(item)
                else:
                    item.drop_turn(self)
            if deadline is not None and time.monotonic() >= deadline:
                return

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Ends spinning and gives the nodes back."""
        self._shut_down = True
        self.wake()
        for node in list(self._nodes):
            self.remove_node(node)
        return True


class SingleThreadedExecutor(Executor):
    """Runs one callback at a time, in the thread that spins."""


class MultiThreadedExecutor(Executor):
    """Runs callbacks of different groups in a pool of threads."""

    def __init__(self, num_threads: int | None = None, *, context: Context | None = None) -> None:
        """Starts the pool."""
        super().__init__(context=context)
        self._pool = ThreadPoolExecutor(num_threads, thread_name_prefix="executor")
        self._errors: SimpleQueue[BaseException] = SimpleQueue()

    def _execute(self, item: Any) -> None:
        group = None if isinstance(item, Task) else item.callback_group
        if group is None or group.enter(item):
            if hasattr(item, "running"):
                item.running = True
            self._pool.submit(self._work, item, group)
        if not self._errors.empty():
            raise self._errors.get()

    def _work(self, item: Any, group: Any) -> None:
        try:
            self._run(item)
        except BaseException as error:
            self._errors.put(error)
        finally:
            if hasattr(item, "running"):
                item.running = False
            for waiting in group.leave() if group is not None else ():
                self.put(waiting)
            self.wake()

    def _wait(self, timeout_sec: float | None) -> Any:
        item = super()._wait(timeout_sec)
        if item is None and not self._errors.empty():
            raise self._errors.get()
        return item

    def _next(self, deadline: float | None) -> Any:
        if not self._errors.empty():
            raise self._errors.get()
        return super()._next(deadline)

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Ends spinning and the pool."""
        done = super().shutdown(timeout_sec)
        self._pool.shutdown(wait=timeout_sec is None or timeout_sec > 0, cancel_futures=True)
        return done
