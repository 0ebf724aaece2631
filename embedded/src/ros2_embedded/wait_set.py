"""Waiting for events of DDS entities, in the thread that calls.

Cyclone DDS could call listeners instead, but from its own threads, with its locks held: one that
waits for Python's lock while a write holds that one would never end.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any

from cyclonedds import core
from cyclonedds.core import DDSException, GuardCondition
from cyclonedds.internal import DDS, dds_c_t
from cyclonedds.util import duration

from ros2_embedded.interrupts import interruptible

Source = tuple[Any, Callable[[], None]]
"""An entity of DDS, and what is called when something has come to it."""

_wait: Any = DDS._dll_handle.dds_waitset_wait  # type: ignore[union-attr]
_FOREVER = duration(infinite=True)
_LONGEST = 1e9
_PATIENCE = 1.0
"""Longest wait for a woken thread to leave [s]: after an interruption it never does."""
_LIBRARY: Any = SimpleNamespace(_ref=0x7FFF_0100)
"""Handle of the parent of all domains (dds_basic_types.h, DDS_CYCLONEDDS_HANDLE)."""


class WaitSet:
    """Waits for several sources, of any domain.

    Any thread may add and remove some or wake those that wait.
    """

    def __init__(self) -> None:
        """Has no sources yet."""
        self._set: Any = core.WaitSet(_LIBRARY)
        self._guard: Any = GuardCondition(_LIBRARY)
        self._lock = threading.RLock()
        self._numbers = itertools.count(1)  # ctypes returns None for 0
        self._calls: dict[int, Callable[[], Any]] = {}
        self._known: dict[Any, int] = {}
        self._waiting: list[int] = []
        """The threads that wait."""
        self._closed = False
        self._attach(self._guard, partial(self._guard.set, False))

    def _attach(self, entity: Any, call: Callable[[], Any]) -> None:
        this, number = self._set, next(self._numbers)
        if this is None:
            return
        try:
            self._calls[number] = call
            self._known[entity] = number
            self._triggered = dds_c_t.attach * len(self._known)
            result = this._waitset_attach(this._ref, entity._ref, number)
            if result < 0:
                raise DDSException(result, "Occurred while attaching to a wait set")
        except BaseException:
            self.remove(entity)
            raise

    def add(self, source: Source, *, at_once: bool = False) -> None:
        """Adds a source, unless it has been added before.

        Args:
            source: the entity, and what is called.
            at_once: calls it now too, for what has come before.
        """
        entity, call = source
        with self._lock:
            if entity not in self._known:
                self._attach(entity, call)
                if at_once:
                    call()

    def remove(self, entity: Any) -> None:
        """Waits for an entity no more; afterwards nothing is called for it."""
        if self._closed:
            return
        with self._lock:
            this, number = self._set, self._known.pop(entity, None)
            if number is not None and this is not None:
                self._calls.pop(number, None)
                this._waitset_detach(this._ref, entity._ref)

    def wake(self) -> None:
        """Ends the waits of all threads."""
        guard = self._guard
        if self._waiting and guard is not None:
            guard.set(True)

    def wait(self, seconds: float, ready: Callable[[], Any] = lambda: False) -> None:
        """Waits until something has come, and hands it over; or until the time is over, or `wake`.

        Args:
            seconds: at most so long; may be infinite.
            ready: whether there is something else to do; what makes it true after it was asked
                has to call `wake`.
        """
        me = threading.get_ident()
        self._waiting.append(me)
        try:
            if self._closed:
                return
            this, triggered = self._set, self._triggered()
            arguments = this._ref, triggered, len(triggered)
            if seconds <= 0 or ready():
                count = _wait(*arguments, 0)
            else:
                limit = int(seconds * 1e9) if seconds < _LONGEST else _FOREVER
                count = interruptible(self.wake, _wait, *arguments, limit)
        finally:
            self._waiting.remove(me)
        if count < 0 and not self._closed:
            raise DDSException(count, "Occurred while waiting")
        with self._lock:
            for number in triggered[: max(count, 0)]:
                call = self._calls.get(number or 0)
                if call is None:
                    continue
                try:
                    call()
                except DDSException:
                    if not self._closed:  # by a signal's handler
                        raise

    def close(self) -> None:
        """Ends all waits and forgets the sources."""
        self._closed = True
        me, deadline = threading.get_ident(), time.monotonic() + _PATIENCE
        while set(self._waiting) - {me} and time.monotonic() < deadline:
            self.wake()
            time.sleep(0.001)
        # Without the lock: a signal's handler may close, while what it interrupts has another lock
        # that a source waits for. What is attached to a wait set that goes is detached by that.
        self._calls, self._known = {}, {}
        self._set = self._guard = None
