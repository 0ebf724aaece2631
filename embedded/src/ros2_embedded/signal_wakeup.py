"""Ctrl-C in a wait that Python cannot interrupt.

Python's handlers of signals run in the main thread, between two steps of Python: not while it
waits in C. But each signal is written into a pipe at once, which another thread reads.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

_T = TypeVar("_T")
_MAIN = threading.main_thread().ident


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

    def during(self, wait: Callable[[], _T], wake: Callable[[], None]) -> _T:
        before = signal.set_wakeup_fd(self._writing, warn_on_full_buffer=False)
        # Who has one of his own, as asyncio has, hears of the signals too.
        self._wake, self._next = wake, -1 if before == self._writing else before
        try:
            return wait()
        finally:
            signal.set_wakeup_fd(before)
            self._wake = None


_pipe: _Pipe | None = None


def interruptible(wait: Callable[[], _T], wake: Callable[[], None]) -> _T:
    """What `wait` returns; a signal that comes in the main thread meanwhile has `wake` called."""
    global _pipe
    if threading.get_ident() != _MAIN:
        return wait()
    _pipe = _pipe or _Pipe()
    return _pipe.during(wait, wake)
