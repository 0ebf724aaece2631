"""Signals where Python cannot handle them at once, or must not.

Python's handlers of signals run in the main thread, between two steps of Python: not while it
waits in C. But each signal is written into a pipe at once, which another thread reads.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress


def in_main_thread() -> bool:
    """Whether it is the thread in which Python handles signals."""
    return threading.get_ident() == threading.main_thread().ident


class _Pipe:
    """The pipe, and the thread that reads it."""

    def __init__(self) -> None:
        self.wake: Callable[[], None] | None = None
        self._next = -1
        reading, self._writing = os.pipe()
        os.set_blocking(self._writing, False)
        threading.Thread(target=self._read, args=(reading,), name="signals", daemon=True).start()

    def _read(self, reading: int) -> None:
        while numbers := os.read(reading, 64):
            wake, following = self.wake, self._next
            if following >= 0:
                with suppress(OSError):
                    os.write(following, numbers)
            if wake is not None:
                wake()

    @contextmanager
    def waking(self, wake: Callable[[], None]) -> Iterator[None]:
        before = signal.set_wakeup_fd(self._writing, warn_on_full_buffer=False)
        outer = self.wake, self._next
        try:
            # Who has one of his own, as asyncio has, hears of the signals too.
            self.wake, self._next = wake, self._next if before == self._writing else before
            yield
        finally:
            signal.set_wakeup_fd(before, warn_on_full_buffer=False)
            self.wake, self._next = outer


_pipe: _Pipe | None = None


def _forget_pipe() -> None:
    global _pipe
    if _pipe is not None and _pipe.wake is not None:
        signal.set_wakeup_fd(-1)
    _pipe = None


os.register_at_fork(after_in_child=_forget_pipe)  # the child has no thread that reads it


def waking(wake: Callable[[], None]) -> AbstractContextManager[None]:
    """Within the block, in the main thread, a signal has `wake` called, in another thread."""
    global _pipe
    _pipe = _pipe or _Pipe()
    return _pipe.waking(wake)


@contextmanager
def signals_wait() -> Iterator[None]:
    """Has SIGINT and SIGTERM come into effect after the block, which they must not cut off.

    Elsewhere than in the main thread, where Python handles signals, it does nothing.
    """
    if not in_main_thread():
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
