"""Signals where Python cannot handle them at once, or must not.

Python's handlers of signals run in the main thread, between two steps of Python: not while it
waits in C. But each signal is written into a pipe at once, which another thread reads.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

_T = TypeVar("_T")


_main_thread = threading.main_thread().ident


def _in_main_thread() -> bool:
    return threading.get_ident() == _main_thread


class _Pipe:
    """The pipe, and the thread that reads it."""

    def __init__(self) -> None:
        self._wake: Callable[[], None] | None = None
        self._next = -1
        reading, self._writing = os.pipe()
        os.set_blocking(self._writing, False)
        threading.Thread(target=self._read, args=(reading,), name="signals", daemon=True).start()

    def _read(self, reading: int) -> None:
        while numbers := os.read(reading, 64):
            wake, following = self._wake, self._next
            if following >= 0:
                with suppress(OSError):
                    os.write(following, numbers)
            if wake is not None:
                wake()

    def during(self, wake: Callable[[], None], wait: Callable[..., _T], *arguments: Any) -> _T:
        self._wake = wake
        before = signal.set_wakeup_fd(self._writing)
        try:
            # A previous wakeup descriptor, such as asyncio's, receives the signals as well.
            self._next = -1 if before == self._writing else before
            return wait(*arguments)
        finally:
            signal.set_wakeup_fd(before)
            self._wake = None


_pipe: _Pipe | None = None


def _begin_anew() -> None:
    """In a forked child, which has no thread that reads the pipe."""
    global _main_thread, _pipe
    _main_thread, _pipe = threading.get_ident(), None


os.register_at_fork(after_in_child=_begin_anew)


def interruptible(wake: Callable[[], None], wait: Callable[..., _T], *arguments: Any) -> _T:
    """Returns the result of `wait`; `wake` is called if a signal arrives in the main thread."""
    global _pipe
    if not _in_main_thread():
        return wait(*arguments)
    _pipe = _pipe or _Pipe()
    return _pipe.during(wake, wait, *arguments)


@contextmanager
def signals_wait() -> Iterator[None]:
    """Has SIGINT and SIGTERM come into effect after the block, which they must not cut off.

    Elsewhere than in the main thread, where Python handles signals, it does nothing.
    """
    if not _in_main_thread():
        yield
        return
    came: list[int] = []
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number in before:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for each in dict.fromkeys(came):
            signal.raise_signal(each)
