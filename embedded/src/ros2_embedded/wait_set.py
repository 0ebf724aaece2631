"""Waiting for what comes to entities of DDS, in the thread that asks for it.

Cyclone DDS could call listeners instead, but from its own threads, with its locks held: one that
waits for Python's lock while a write holds that one would never end.
"""

from __future__ import annotations

import itertools
import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

from cyclonedds import core
from cyclonedds.core import DDSException, GuardCondition
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import dds_c_t
from cyclonedds.util import duration

from ros2_embedded.signal_wakeup import interruptible

Source = tuple[Any, Callable[[], None]]
"""An entity of DDS, and what is called when something has come to it."""

_FOREVER = duration(infinite=True)
_LONGEST = 1e9
_WOKEN = 0
_PATIENCE = 1.0
"""How long a thread that was woken may take to leave [s]: one that a signal cut off never does."""


class WaitSet:
    """Waits for several sources. Any thread may add and remove some or wake those that wait."""

    def __init__(self, participant: DomainParticipant) -> None:
        """Has no sources yet."""
        self._set = core.WaitSet(participant)
        self._guard = guard = GuardCondition(participant)
        self._lock = threading.RLock()
        self._numbers = itertools.count(_WOKEN)
        self._calls: dict[int, Callable[[], None]] = {}
        self._known: dict[Any, int] = {}
        self._waiting: list[int] = []
        """The threads that wait."""
        self._closed = False
        self._attach(guard, lambda: guard.set(False))

    def _attach(self, entity: Any, call: Callable[[], None]) -> None:
        number = next(self._numbers)
        self._calls[number] = call
        self._known[entity] = number
        self._triggered = dds_c_t.attach * len(self._known)
        result = self._set._waitset_attach(self._set._ref, entity._ref, number)
        if result < 0:
            raise DDSException(result, "Occurred while attaching to a wait set")

    def add(self, source: Source, *, at_once: bool = False) -> None:
        """From now on waits for a source too, unless it does so already.

        Args:
            source: the entity, and what is called.
            at_once: calls it now too, for what has come before.
        """
        entity, call = source
        with self._lock:
            if entity not in self._known and not self._closed:
                self._attach(entity, call)
                if at_once:
                    call()

    def remove(self, entity: Any) -> None:
        """Waits for an entity no more; afterwards nothing is called for it."""
        with self._lock:
            number = self._known.pop(entity, None)
            if number is not None:
                del self._calls[number]
                self._set._waitset_detach(self._set._ref, entity._ref)

    def wake(self) -> None:
        """Ends the waits of all threads."""
        if self._waiting:
            try:
                self._guard.set(True)
            except DDSException:
                if not self._closed:  # the domain has been left meanwhile
                    raise

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
            triggered = self._triggered()
            arguments = self._set._ref, triggered, len(triggered)
            if ready() or seconds == 0:
                count = self._set._waitset_wait(*arguments, 0)
            else:
                limit = int(seconds * 1e9) if seconds < _LONGEST else _FOREVER
                count = interruptible(lambda: self._set._waitset_wait(*arguments, limit), self.wake)
        finally:
            self._waiting.remove(me)
        if count < 0 and not self._closed:
            raise DDSException(count, "Occurred while waiting")
        if count > 0:
            self._hand_over(triggered[: min(count, len(triggered))])

    def _hand_over(self, numbers: list[int | None]) -> None:
        with self._lock:
            for number in numbers:
                call = self._calls.get(number or _WOKEN)
                if call is not None and not self._closed:
                    try:
                        call()
                    except DDSException:
                        raise
                    except Exception:  # what cannot be read must not make the process deaf
                        traceback.print_exc()

    def close(self) -> None:
        """Ends all waits and forgets the sources."""
        self._closed = True
        me, deadline = threading.get_ident(), time.monotonic() + _PATIENCE
        while set(self._waiting) - {me} and time.monotonic() < deadline:
            self.wake()
            time.sleep(0.001)
        with self._lock:
            for entity in list(self._known):
                self.remove(entity)
