"""The entities that an executor serves: each has an inbox for received samples."""

from __future__ import annotations

from collections import deque
from typing import Any

from ros2_embedded.samples import samples_of
from ros2_embedded.wait_set import Source

from rclpy.callback_groups import CallbackGroup


class Entity:
    """Base of subscriptions, services and clients: one sample per turn, the oldest first."""

    def __init__(self, node: Any, group: CallbackGroup | None, depth: int) -> None:
        """Keeps at most `depth` samples until the executor handles them; 0 means all."""
        self.node, self._handle = node, node.handle
        self.callback_group = group or node.default_callback_group
        self.callback_group.add_entity(self)
        self._endpoints = Endpoints(node)
        self._inbox: deque[Any] = deque(maxlen=depth or None)
        self._queued_in: Any = None

    @property
    def sources(self) -> list[Source]:
        """The sources that its executor waits for."""
        return self._endpoints.sources

    def receive(self, samples: list[Any]) -> None:
        """Puts received samples into the inbox."""
        self._inbox.extend(samples)
        self.wake()

    def wake(self) -> None:
        """Queues the entity in the executor, unless the inbox is empty or it is queued already."""
        if not self._inbox:
            return
        executor = self._handle.executor
        if executor is not None and self._queued_in is not executor:
            self._queued_in = executor  # before it is in the queue, of which a turn clears this
            executor.put(self)

    def take(self) -> tuple[Any] | None:
        """Returns one sample to handle, in a tuple; queues the entity again if there are more."""
        try:
            sample = self._inbox.popleft()
        except IndexError:
            return None
        if self._inbox:
            self.wake()
        return (sample,)

    def requeue(self) -> None:
        """Queues the entity again, after a turn that could not be used."""
        self._queued_in = None
        self.wake()

    def drop_turn(self, executor: Any) -> None:
        """Notes that the executor has dequeued the entity: the next sample queues it again."""
        if self._queued_in is executor:
            self._queued_in = None

    def handle(self, sample: Any) -> Any:
        """Handles a sample; a coroutine is returned, which the executor runs."""
        raise NotImplementedError


class Endpoints:
    """The DDS writers and readers of one entity: registers them in the graph, and releases them."""

    def __init__(self, node: Any) -> None:
        """Has no endpoints at first."""
        self._node = node
        self._writers: list[Any] = []
        self._readers: list[Any] = []
        self.sources: list[Source] = []
        """The sources that deliver the readers' samples."""

    def add_writer(self, writer: Any) -> None:
        """Adds a writer to the graph."""
        self._writers.append(writer)
        self._node.handle.entry.writers.append(writer.guid.bytes)
        self._node.context.graph.changed()

    def add_reader(self, reader: Any, sink: Any) -> None:
        """Adds a reader to the graph; `sink` receives its samples."""
        self._readers.append(reader)
        self.sources.append(samples_of(reader, sink))
        self._node.handle.entry.readers.append(reader.guid.bytes)
        self._node.context.graph.changed()

    def release(self) -> None:
        """Removes the endpoints from the graph."""
        entry, executor, context = self._node.handle.entry, self._node.executor, self._node.context
        with context.lock:
            if context.graph is not None:
                for writer in self._writers:
                    entry.writers.remove(writer.guid.bytes)
                for reader in self._readers:
                    entry.readers.remove(reader.guid.bytes)
                for source, _ in self.sources:
                    if executor is not None:
                        executor.forget(source)
                context.graph.changed()
        self._writers, self._readers, self.sources = [], [], []
