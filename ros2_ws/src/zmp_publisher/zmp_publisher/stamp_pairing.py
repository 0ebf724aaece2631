"""Pairing of samples from several streams that carry the same stamp."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Generic, TypeVar

from door_impact_common.errors import SettingError

Sample = TypeVar("Sample")


class StampPairer(Generic[Sample]):
    """Buffer of samples until every stream has a sample of the same stamp.

    When the stamps of a stream jump backwards (the simulation was reset), the stream's buffered
    samples are dropped. So no sample from before the jump is paired with a sample after it.

    Args:
        streams: Names of the streams.
        capacity: Number of samples kept of each stream while other streams are late.

    Attributes:
        dropped: Number of samples dropped because another stream had no sample of their stamp.

    Raises:
        SettingError: The capacity is below 1.
    """

    def __init__(self, streams: tuple[Hashable, ...], capacity: int = 50) -> None:
        if capacity < 1:
            raise SettingError("capacity", capacity, "at least 1")
        self._buffers: dict[Hashable, dict[int, Sample]] = {name: {} for name in streams}
        self._last: dict[Hashable, int] = {}
        self._capacity = capacity
        self.dropped = 0

    def add(self, stream: Hashable, stamp: int, sample: Sample) -> Mapping[Hashable, Sample] | None:
        """Add a sample.

        Args:
            stream: Name of the stream.
            stamp: Stamp of the sample [ns].
            sample: The sample.

        Returns:
            The samples of all streams with this stamp if this sample completes them, else None.
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
