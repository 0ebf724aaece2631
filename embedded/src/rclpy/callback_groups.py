"""Callback groups: which callbacks may run at the same time in a MultiThreadedExecutor."""

from __future__ import annotations

import threading
from typing import Any


class CallbackGroup:
    """A group of a node's entities."""

    def __init__(self) -> None:
        """Nothing runs at first."""
        self._lock = threading.Lock()
        self._waiting: list[Any] = []
        self._running = False

    def enter(self, entity: Any) -> bool:
        """Whether the entity's callback may run now; if not, `leave` gives it back."""
        return True

    def leave(self) -> list[Any]:
        """Says that a callback has ended; returns the entities that had to wait."""
        return []


class ReentrantCallbackGroup(CallbackGroup):
    """Callbacks of this group may run at the same time."""


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """One callback of this group runs at a time."""

    def enter(self, entity: Any) -> bool:
        """Whether no other callback of the group runs."""
        with self._lock:
            if self._running:
                self._waiting.append(entity)
                return False
            self._running = True
            return True

    def leave(self) -> list[Any]:
        """Lets the next one in."""
        with self._lock:
            waiting, self._waiting = self._waiting, []
            self._running = False
            return waiting
