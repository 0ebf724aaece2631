"""Matching of messages by their stamps: several streams, and an IMU's readings."""

from __future__ import annotations

from collections import deque
from typing import Any, TypeAlias

from humanoid_motion.samples import ImuSample

from robot_driver.trajectory_driver import PERIOD

_HALF = 0.5 * PERIOD  # difference of stamps from which on they are of other periods [s]

Match: TypeAlias = tuple[float, Any, ImuSample | None]
"""Stamp [s] of a sample, the sample, and the nearest reading of the IMU."""


class StampPairer:
    """Buffer of samples until every stream has a sample of the same control period.

    Each broadcaster takes its own time, so stamps of one period differ by up to half of it. Stamps
    of a stream increase.

    Args:
        streams: Names of the streams; the first one's stamps are those of the pairs.
        capacity: Number of samples kept of each stream while other streams are late.

    Attributes:
        dropped: Number of samples dropped because another stream had no sample of their period.
    """

    def __init__(self, streams: tuple[str, ...], capacity: int = 50) -> None:
        self._buffers: dict[str, deque[tuple[float, Any]]] = {name: deque() for name in streams}
        self._capacity = capacity
        self.dropped = 0

    def add(self, stream: str, stamp: float, sample: Any) -> tuple[float, dict[str, Any]] | None:
        """Add a sample.

        Args:
            stream: Name of its stream.
            stamp: Its stamp [s].

        Returns:
            The first stream's stamp, and the samples of all streams nearest to this one, if it
            completes them, else None.
        """
        own = self._buffers[stream]
        own.append((stamp, sample))
        if len(own) > self._capacity:
            own.popleft()
            self.dropped += 1
        nearest = {name: min(buffer, key=lambda each: abs(each[0] - stamp), default=None)
                   for name, buffer in self._buffers.items()}
        found = {name: each for name, each in nearest.items()
                 if each is not None and abs(each[0] - stamp) < _HALF}
        if len(found) < len(nearest):
            return None
        for name, buffer in self._buffers.items():
            while buffer[0][0] < found[name][0]:
                buffer.popleft()
                self.dropped += 1
            buffer.popleft()
        return next(iter(found.values()))[0], {name: each[1] for name, each in found.items()}


class ImuMatcher:
    """Gives each sample the reading of the nearest stamp.

    A sample waits until a reading of its control period or a later one has arrived. It does not
    wait for an IMU that is silent: if the newest reading is older than the sample by more than
    `patience`, the sample has no reading. Stamps of samples and of readings increase.

    Args:
        patience: Largest difference between the stamps of a sample and its reading [s].
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._waiting: deque[tuple[float, Any]] = deque()
        self._readings: deque[tuple[float, ImuSample]] = deque()

    def add_sample(self, stamp: float, sample: Any) -> list[Match]:
        """Add a sample with its stamp [s]; return what matches now."""
        self._waiting.append((stamp, sample))
        return self._matches()

    def add_reading(self, stamp: float, reading: ImuSample) -> list[Match]:
        """Add a reading with its stamp [s]; return what matches now."""
        self._readings.append((stamp, reading))
        # Readings may come without samples; only those that a later sample can need are kept.
        while stamp - self._readings[0][0] > 2 * self._patience:
            self._readings.popleft()
        return self._matches()

    def _matches(self) -> list[Match]:
        found: list[Match] = []
        newest_sample = self._waiting[-1][0] if self._waiting else 0.0
        while self._waiting:
            stamp, sample = self._waiting[0]
            newest = self._readings[-1][0] if self._readings else None
            silent = newest is None or newest_sample - newest > self._patience
            if not silent and newest is not None and newest <= stamp - _HALF:
                break
            self._waiting.popleft()
            found.append((stamp, sample, self._nearest(stamp)))
        return found

    def _nearest(self, stamp: float) -> ImuSample | None:
        """Return the reading of the nearest stamp; older ones are not needed any more."""
        readings = self._readings
        while len(readings) > 1 and abs(readings[1][0] - stamp) <= abs(readings[0][0] - stamp):
            readings.popleft()
        near = bool(readings) and abs(readings[0][0] - stamp) <= self._patience
        return readings[0][1] if near else None
