"""Futures, and tasks that an executor works off."""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable, Generator
from typing import Any


class Future:
    """A result that comes later. It can be awaited in a coroutine that an executor runs."""

    def __init__(self, *, executor: Any = None) -> None:
        """Has no result yet; callbacks run in `executor` where one is given."""
        self._lock = threading.RLock()
        self._done = self._cancelled = False
        self._result: Any = None
        self._exception: BaseException | None = None
        self._callbacks: list[Callable[[Future], Any]] = []
        self._executor = executor
        self._exception_fetched = False

    def __await__(self) -> Generator[Future, None, Any]:
        """Hands itself to the task that awaits it until it is done."""
        while not self._done:
            yield self
        return self.result()

    def done(self) -> bool:
        """Whether there is a result, an exception or a cancellation."""
        return self._done

    def cancelled(self) -> bool:
        """Whether it was cancelled."""
        return self._cancelled

    def result(self) -> Any:
        """The result, None if there is none; an exception is raised again."""
        if self._exception is not None:
            self._exception_fetched = True
            raise self._exception
        return self._result

    def exception(self) -> BaseException | None:
        """The exception, if one was set."""
        self._exception_fetched = True
        return self._exception

    def set_result(self, result: Any) -> None:
        """Sets the result and runs the callbacks."""
        self._finish(result=result)

    def set_exception(self, exception: BaseException) -> None:
        """Sets the exception and runs the callbacks."""
        self._finish(exception=exception)

    def cancel(self) -> None:
        """Cancels it, unless it is done."""
        self._finish(cancelled=True)

    def _finish(
        self,
        result: Any = None,
        exception: BaseException | None = None,
        cancelled: bool = False,
    ) -> None:
        with self._lock:
            if self._done:
                return
            self._result, self._exception, self._cancelled = result, exception, cancelled
            self._done = True
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback(self)

    def add_done_callback(self, callback: Callable[[Future], Any]) -> None:
        """Has `callback(future)` called when it is done, at once if it is."""
        with self._lock:
            if not self._done:
                self._callbacks.append(callback)
                return
        callback(self)

    def remove_done_callback(self, callback: Callable[[Future], Any]) -> bool:
        """Forgets a callback; whether it was there."""
        with self._lock:
            found = callback in self._callbacks
            if found:
                self._callbacks.remove(callback)
            return found


class Task(Future):
    """A function or a coroutine that an executor runs; the future of what it returns."""

    def __init__(
        self, handler: Any, args: Any = (), kwargs: Any = None, executor: Any = None
    ) -> None:
        """Nothing runs until the executor calls `step`."""
        super().__init__(executor=executor)
        self._handler, self._args, self._kwargs = handler, args, kwargs or {}
        self._coroutine = handler if inspect.iscoroutine(handler) else None

    def cancel(self) -> None:
        """Cancels it: a coroutine goes no further."""
        super().cancel()
        coroutine = self._coroutine
        if coroutine is not None and inspect.getcoroutinestate(coroutine) != inspect.CORO_RUNNING:
            coroutine.close()

    def step(self) -> None:
        """Runs until the end, or until the coroutine awaits something that is not there yet."""
        if self.done():
            return
        try:
            if self._coroutine is None:
                result = self._handler(*self._args, **self._kwargs)
                if not inspect.iscoroutine(result):
                    self.set_result(result)
                    return
                self._coroutine = result
            awaited = self._coroutine.send(None)
        except StopIteration as stop:
            self.set_result(stop.value)
        except Exception as error:
            self.set_exception(error)
        else:
            if isinstance(awaited, Future):
                awaited.add_done_callback(lambda _: self._executor.wake_task(self))
            else:
                self._executor.wake_task(self)
