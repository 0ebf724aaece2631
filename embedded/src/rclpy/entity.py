"""What an executor works on: things with an inbox that the reader thread fills."""

from __future__ import annotations

from collections import deque
from typing import Any

from rclpy.callback_groups import CallbackGroup


class Entity:
    """Base of subscriptions, services and clients: one sample a turn, oldest first."""

    def __init__(self, node: Any, group: CallbackGroup | None, depth: int) -> None:
        """Keeps at most `depth` samples that wait for the executor (0: all)."""
        self.node = node
        self.callback_group = group or node.default_callback_group
        self.callback_group.add_entity(self)
        self._inbox: deque[Any] = deque(maxlen=depth or None)
        self._queued_in: Any = None

    def receive(self, samples: list[Any]) -> None:
        """Takes samples from the reader thread."""
        self._inbox.extend(samples)
        self.wake()

    def wake(self) -> None:
        """Asks the executor for a turn, if there is something to do; once is enough."""
        executor = self.node.executor
        if executor is not None and self._inbox and self._queued_in is not executor:
            self._queued_in = executor
            executor.put(self)

    def take(self) -> tuple[Any] | None:
        """One sample to handle, in a tuple; asks for another turn if there are more."""
        # Cleared first: what comes from now on asks for another turn.
        self._queued_in = None
        try:
            sample = self._inbox.popleft()
        except IndexError:
            return None
        self.wake()
        return (sample,)

    def requeue(self) -> None:
        """Asks again, after a turn that could not be used."""
        self._queued_in = None
        self.wake()

    def drop_turn(self, executor: Any) -> None:
        """The executor does not own the node any more."""
        if self._queued_in is executor:
            self._queued_in = None

    def handle(self, sample: Any) -> Any:
        """Does what the entity is there for; a coroutine is returned for the executor to run."""
        raise NotImplementedError


class Endpoints:
    """The DDS writers and readers of one entity: registers them in the graph, and releases them."""

    def __init__(self, node: Any) -> None:
        """Has none yet."""
        self._node = node
        self._writers: list[Any] = []
        self._readers: list[tuple[Any, Any]] = []

    def add_writer(self, writer: Any) -> None:
        """Tells the graph of a writer."""
        self._writers.append(writer)
        self._node.handle.entry.writers.append(writer.guid.bytes)
        self._node.context.graph.changed()

    def add_reader(self, reader: Any, sink: Any) -> None:
        """Tells the graph of a reader and has the reader thread serve it."""
        condition = self._node.context.reader_thread.add(reader, sink)
        self._readers.append((reader, condition))
        self._node.handle.entry.readers.append(reader.guid.bytes)
        self._node.context.graph.changed()

    def release(self) -> None:
        """Takes them out of the graph and forgets them."""
        entry, context = self._node.handle.entry, self._node.context
        for writer in self._writers:
            entry.writers.remove(writer.guid.bytes)
        for reader, condition in self._readers:
            context.reader_thread.remove(condition)
            entry.readers.remove(reader.guid.bytes)
        self._writers, self._readers = [], []
        context.graph.changed()
