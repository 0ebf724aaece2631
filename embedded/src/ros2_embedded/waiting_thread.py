"""A thread that waits in Cyclone DDS, where Ctrl-C cannot interrupt it."""

from __future__ import annotations

import threading
from typing import Any

from cyclonedds.core import DDSException, GuardCondition, WaitSet
from cyclonedds.domain import DomainParticipant


class WaitingThread:
    """Base of the threads that wait for entities, each of which has something that it calls."""

    def __init__(self, participant: DomainParticipant, name: str, sinks: Any) -> None:
        """Starts the thread; `sinks` is the mapping of entities to what is called."""
        self._waitset = WaitSet(participant)
        self._guard = GuardCondition(participant)
        self._waitset.attach(self._guard)
        self._sinks = sinks
        self._lock = threading.RLock()
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def remove(self, entity: Any) -> None:
        """Waits for an entity no more; afterwards its sink is not called."""
        with self._lock:
            if self._sinks.pop(entity, None) is not None:
                self._waitset.detach(entity)

    def stop(self) -> None:
        """Ends the thread, after a last turn, and forgets the entities."""
        self._stopping = True
        self._guard.set(True)
        if threading.current_thread() is not self._thread:
            self._thread.join()
        with self._lock:
            for entity in list(self._sinks):
                self.remove(entity)
            self._waitset.detach(self._guard)

    def _run(self) -> None:
        while not self._stopping:
            try:
                self._turn()
            except DDSException:
                # A second Ctrl-C can cut off `stop` and take the entities away under this thread.
                if not self._stopping:
                    raise

    def _turn(self) -> None:
        """Waits once, and handles what has come."""
        raise NotImplementedError
