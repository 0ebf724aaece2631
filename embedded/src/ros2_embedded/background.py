"""The one thread of a process that works for the runtime itself; it sleeps nearly always."""

from __future__ import annotations

import math
import threading
import time
import traceback
import weakref
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from ros2_embedded.wait_set import Source, WaitSet

_PATIENCE = 1.0  # longest wait for the end of the thread [s]


class Background:
    """Handles changes of the graph and of the status of endpoints, and calls what is due."""

    def __init__(self) -> None:
        """Starts the thread."""
        self._wait_set = WaitSet()
        self._soon: SimpleQueue[Callable[[], Any]] = SimpleQueue()
        self._due: dict[Callable[[], Any], float] = {}
        """When each pending function is called [s]; only the thread uses it."""
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="background", daemon=True)
        self._thread.start()

    def add(self, source: Source, *, at_once: bool = False) -> None:
        """Has the thread serve a source; the arguments are those of `WaitSet.add`."""
        self._wait_set.add(source, at_once=at_once)

    def remove(self, entity: object) -> None:
        """Removes the source of an entity: afterwards nothing is called for it."""
        self._wait_set.remove(entity)

    def call_soon(self, function: Callable[[], Any]) -> None:
        """Has `function` called soon; needs no lock, so the garbage collector may call this."""
        self._soon.put(function)
        self._wait_set.wake()

    def call_when_gone(self, thing: Any, function: Callable[[], Any]) -> weakref.finalize[Any, Any]:
        """Has `function` called when nothing refers to `thing` any more, but not at the exit."""
        end = weakref.finalize(thing, self.call_soon, function)
        end.atexit = False
        return end

    def call_later(self, delay: float, function: Callable[[], Any]) -> None:
        """Has `function` called after `delay` [s], unless a call of it is pending."""
        at = time.monotonic() + delay
        self.call_soon(lambda: self._due.setdefault(function, at))

    def stop(self) -> None:
        """Ends the thread; pending functions are not called any more.

        A signal handler may call this method while the code that it interrupts holds a lock that
        the thread needs. The wait for the end of the thread is therefore limited.
        """
        self._stopping = True
        self._wait_set.wake()
        if threading.current_thread() is not self._thread:
            self._thread.join(_PATIENCE)
        self._wait_set.close()

    def _run(self) -> None:
        while not self._stopping:
            left = min(self._due.values(), default=math.inf) - time.monotonic()
            try:
                self._wait_set.wait(max(0.0, left), self._has_work)
                self._do_what_is_due()
            except Exception:  # an unreadable sample must not end this thread
                # A second Ctrl-C can interrupt `stop`, and end the entities before this thread.
                if not self._stopping:
                    traceback.print_exc()

    def _has_work(self) -> bool:
        return self._stopping or not self._soon.empty()

    def _do_what_is_due(self) -> None:
        while not self._soon.empty():
            self._soon.get()()
        now = time.monotonic()
        for function, at in list(self._due.items()):
            if at <= now:
                del self._due[function]
                function()
