"""Futures, and tasks that an executor works off."""

from __future__ import annotations

import inspect
import sys
import threading
import warnings
import weakref
from collections.abc import Callable, Generator
from typing import Any


class Future:
    """A result that is set later. Coroutines of executors and of asyncio can await it."""

    def __init__(self, *, executor: Any = None) -> None:
        """Has no result yet; done callbacks are tasks of `executor` where one is given."""
        self._lock = threading.Lock()
        self._done = self._cancelled = False
        self._result: Any = None
        self._exception: BaseException | None = None
        self._exception_fetched = False
        self._callbacks: list[Callable[[Future], Any]] = []
        self._wakers: list[Callable[[], Any]] = []
        self._executor: Callable[[], Any] = _nothing
        self._set_executor(executor)

    def __del__(self) -> None:
        """Prints an exception that was never retrieved."""
        if self._exception is not None and not self._exception_fetched:
            text = f"The following exception was never retrieved: {self._exception}"
            print(text, file=sys.stderr)

    def __await__(self) -> Generator[_Awaited, None, Any]:
        """Waits in the coroutine of an executor's task, or of a task of asyncio."""
        while not self._done:
            yield _Awaited(self)
        return self.result()

    def done(self) -> bool:
        """Whether there is a result, an exception or a cancellation."""
        return self._done

    def cancelled(self) -> bool:
        """Whether the future was cancelled."""
        return self._cancelled

    def result(self) -> Any:
        """The result, or None if there is no result; an exception is raised again."""
        exception = self.exception()
        if exception is not None:
            raise exception
        return self._result

    def exception(self) -> BaseException | None:
        """The exception, if one was set."""
        self._exception_fetched = True
        return self._exception

    def set_result(self, result: Any) -> None:
        """Sets the result and has the callbacks called."""
        with self._lock:
            self._result = result
            self._done, self._cancelled = True, False
        self._finish()

    def set_exception(self, exception: BaseException) -> None:
        """Sets the exception and has the callbacks called."""
        with self._lock:
            self._exception, self._exception_fetched = exception, False
            self._done, self._cancelled = True, False
        self._finish()

    def cancel(self) -> None:
        """Cancels it, unless it is done."""
        with self._lock:
            if not self._done:
                self._done = self._cancelled = True
        self._finish()

    def _finish(self) -> None:
        with self._lock:
            callbacks, self._callbacks = self._callbacks, []
            wakers, self._wakers = self._wakers, []
            executor = self._executor()
        for wake in wakers:
            wake()
        for callback in callbacks:
            if executor is not None:
                executor.create_task(callback, self)
                continue
            try:
                callback(self)
            except Exception as error:  # there may be more callbacks to call
                warnings.warn(f"Unhandled exception in done callback: {error}", stacklevel=3)

    def _set_executor(self, executor: Any) -> None:
        self._executor = _nothing if executor is None else weakref.ref(executor)

    def add_done_callback(self, callback: Callable[[Future], Any]) -> None:
        """Has `callback(future)` called when it is done, or now if it is.

        The executor that fills in the future does it, as a task; without one the caller of
        `set_result` does.
        """
        with self._lock:
            if not self._done:
                self._callbacks.append(callback)
                return
            executor = self._executor()
        if executor is not None:
            executor.create_task(callback, self)
        else:
            callback(self)

    def _add_waker(self, wake: Callable[[], Any]) -> None:
        """Has `wake` called as soon as it is done, in the thread that completes it."""
        with self._lock:
            if not self._done:
                self._wakers.append(wake)
                return
        wake()

    def _remove_waker(self, wake: Callable[[], Any]) -> None:
        with self._lock:
            if wake in self._wakers:
                self._wakers.remove(wake)


def _nothing() -> None:
    """Replaces the weak reference to an executor if there is no executor."""


class _Awaited:
    """The object that a coroutine yields while it awaits a future; an executor waits for `future`.

    For asyncio it is one of asyncio's own futures, which is done when `future` is done.
    """

    _asyncio_future_blocking = True

    def __init__(self, future: Future) -> None:
        self.future = future

    def get_loop(self) -> Any:
        from asyncio import get_running_loop  # slow to import, and there already

        return get_running_loop()

    def add_done_callback(self, callback: Callable[[Any], Any], *, context: Any = None) -> None:
        loop = self.get_loop()
        self._waiter = waiter = loop.create_future()

        def finish() -> None:
            if not waiter.done():
                waiter.set_result(None)

        def wake() -> None:
            loop.call_soon_threadsafe(finish)

        waiter.add_done_callback(lambda _: self.future._remove_waker(wake))
        waiter.add_done_callback(callback, context=context)
        self.future._add_waker(wake)

    def cancel(self, msg: Any = None) -> bool:
        """Ends the waiting, not the future."""
        return bool(self._waiter.cancel(msg))


class Task(Future):
    """A function or a coroutine that an executor runs; the future of what it returns."""

    def __init__(
        self, handler: Any, args: Any = None, kwargs: Any = None, executor: Any = None
    ) -> None:
        """Nothing runs until the executor calls the task."""
        super().__init__(executor=executor)
        self._handler, self._args, self._kwargs = handler, args or (), kwargs or {}
        if inspect.iscoroutinefunction(handler):
            self._handler = handler(*self._args, **self._kwargs)
        self._executing = False

    def executing(self) -> bool:
        """Whether the task runs at this moment."""
        return self._executing

    def cancel(self) -> None:
        """Cancels it: a coroutine goes no further."""
        super().cancel()
        if inspect.iscoroutine(self._handler) and not self._executing:
            self._handler.close()

    def __call__(self) -> None:
        """Runs until the end, or until the coroutine awaits something that is not there yet."""
        if self._done or self._executing:
            return
        self._executing = True
        awaited: Any = None
        coroutine = self._handler if inspect.iscoroutine(self._handler) else None
        try:
            if coroutine is not None:
                awaited = coroutine.send(None)
            else:
                self.set_result(self._handler(*self._args, **self._kwargs))
        except Exception as error:
            if coroutine is not None and isinstance(error, StopIteration):
                self.set_result(error.value)
            else:
                self.set_exception(error)
        finally:
            self._executing = False
        if self._done:
            self._handler = self._args = self._kwargs = None
        elif isinstance(awaited, _Awaited):
            # This must be last: another thread may resume the task at once.
            awaited.future._add_waker(self._resume)
        else:
            self._resume()

    def _resume(self) -> None:
        executor = self._executor()
        if executor is not None:
            executor.put(self)
