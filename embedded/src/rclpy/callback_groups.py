"""Callback groups: which callbacks may run at the same time."""

from __future__ import annotations

import threading
import weakref
from typing import Any


class CallbackGroup:
    """Base of the groups; a custom class implements the three methods that raise."""

    def __init__(self) -> None:
        """Has no entities yet."""
        super().__init__()
        self.entities: set[weakref.ref[Any]] = set()
        self.parked: dict[Any, None] = {}
        """Entities that wait for the end of another entity's callback."""
        self.__lock = threading.Lock()

    def add_entity(self, entity: Any) -> None:
        """Adds a subscription, timer, service, client or guard condition to the group."""
        self.entities.add(weakref.ref(entity, self.entities.discard))

    def has_entity(self, entity: Any) -> bool:
        """Whether the entity belongs to the group."""
        return weakref.ref(entity) in self.entities

    def can_execute(self, entity: Any) -> bool:
        """Whether the entity's callback may run now."""
        raise NotImplementedError

    def beginning_execution(self, entity: Any) -> bool:
        """Whether the entity's callback may run now; if so, `ending_execution` must follow it."""
        raise NotImplementedError

    def ending_execution(self, entity: Any) -> None:
        """Notes that the callback of the entity has ended."""
        raise NotImplementedError

    def park(self, entity: Any) -> None:
        """Keeps an entity, whose callback may not run now, until another callback has ended."""
        with self.__lock:
            self.parked[entity] = None
        if self.can_execute(entity):  # it ended just now
            self.unpark()

    def unpark(self) -> None:
        """Queues the kept entities in their executors again, in their order."""
        with self.__lock:
            parked, self.parked = self.parked, {}
        for entity in parked:
            entity.requeue()


class ReentrantCallbackGroup(CallbackGroup):
    """Callbacks of this group may run at the same time."""

    def can_execute(self, entity: Any) -> bool:
        """Returns True: callbacks of this group may always run."""
        return True

    def beginning_execution(self, entity: Any) -> bool:
        """Returns True: callbacks of this group may always run."""
        return True

    def ending_execution(self, entity: Any) -> None:
        """Does nothing."""


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """One callback of this group runs at a time; a coroutine that awaits has not ended."""

    def __init__(self) -> None:
        """No callback runs at first."""
        super().__init__()
        self.__active: Any = None
        self.__lock = threading.Lock()

    def can_execute(self, entity: Any) -> bool:
        """Whether no callback of the group runs."""
        return self.__active is None

    def beginning_execution(self, entity: Any) -> bool:
        """Whether no other callback of the group runs."""
        with self.__lock:
            if self.__active is not None:
                return False
            self.__active = entity
            return True

    def ending_execution(self, entity: Any) -> None:
        """Lets the next callback run."""
        self.__active = None
