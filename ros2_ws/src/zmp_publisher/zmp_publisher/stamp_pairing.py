"""Putting samples together that carry the same stamp."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Generic, TypeVar

from door_impact_common.errors import SettingError

Sample = TypeVar("Sample")


class StampPairer(Generic[Sample]):
    """Waits until every stream has a sample of the same stamp.

    A stream whose stamps jump backwards (the simulation was reset) drops what it had buffered, so
    nothing from before the jump is put together with anything after it.

    Args:
        streams: Their names.
        capacity: Samples kept of each stream while the others are late.
    """

    def __init__(self, streams: tuple[Hashable, ...], capacity: int = 50) -> None:
        if capacity < 1:
            raise SettingError("capacity", capacity, "at least 1")
        self._buffers: dict[Hashable, dict[int, Sample]] = {name: {} for name in streams}
        self._last: dict[Hashable, int] = {}
        self._capacity = capacity
        #: Samples dropped because another stream never had their stamp.
        self.dropped = 0

    def add(self, stream: Hashable, stamp: int, sample: Sample) -> Mapping[Hashable, Sample] | None:
        """Take a sample.

        Args:
            stream: One of the names.
            stamp: Of the sample [ns].
            sample: Anything.

        Returns:
            The samples of all streams with that stamp when this one completes them, else None.
        """
        buffer = self._buffers[stream]
        if stamp < self._last.get(stream, stamp):
            self.dropped += len(buffer)
            buffer.clear()
        self._last[stream] = stamp
        buffer[stamp] = sample
        if len(buffer) > self._capacity:
            del buffer[next(iter(buffer))]
            self.dropped += 1
        if not all(stamp in other for other in self._buffers.values()):
            return None
        together = {name: other.pop(stamp) for name, other in self._buffers.items()}
        for other in self._buffers.values():
            for late in [key for key in other if key < stamp]:
                del other[late]
                self.dropped += 1
        return together
