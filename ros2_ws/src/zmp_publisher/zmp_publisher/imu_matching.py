"""Matching of samples with the readings of an IMU, which may be missing or have other stamps."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

from door_impact_common.errors import SettingError

Sample = TypeVar("Sample")
Reading = TypeVar("Reading")


class ImuMatcher(Generic[Sample, Reading]):
    """Gives each sample the reading of the nearest stamp.

    A sample waits until a reading of its stamp or a later one has arrived. It does not wait for an
    IMU that is silent: if the newest reading is older than the sample by more than `patience`, the
    sample has no reading. When stamps of samples or readings go back (the simulation was reset),
    everything from before is dropped.

    Args:
        patience: Largest difference between the stamps of a sample and its reading [ns].

    Raises:
        SettingError: The patience is not positive.
    """

    def __init__(self, patience: int) -> None:
        if patience <= 0:
            raise SettingError("patience", patience, "positive")
        self._patience = patience
        self._waiting: deque[tuple[int, Sample]] = deque()
        self._readings: deque[tuple[int, Reading]] = deque()
        self._last_sample: int | None = None

    def add_sample(self, stamp: int, sample: Sample) -> list[tuple[int, Sample, Reading | None]]:
        """Add a sample with its stamp [ns]; return the stamp, sample and reading of each match."""
        if self._last_sample is not None and stamp < self._last_sample:
            self._waiting.clear()
            self._readings.clear()
        self._last_sample = stamp
        self._waiting.append((stamp, sample))
        return self._matches()

    def add_reading(
        self, stamp: int, reading: Reading
    ) -> list[tuple[int, Sample, Reading | None]]:
        """Add a reading with its stamp [ns]; return the stamp, sample and reading of each match."""
        if self._readings and stamp < self._readings[-1][0]:
            self._waiting.clear()
            self._readings.clear()
        self._readings.append((stamp, reading))
        # Readings may come without samples; only those that a later sample can need are kept.
        while stamp - self._readings[0][0] > 2 * self._patience:
            self._readings.popleft()
        return self._matches()

    def _matches(self) -> list[tuple[int, Sample, Reading | None]]:
        found: list[tuple[int, Sample, Reading | None]] = []
        newest_sample = self._waiting[-1][0] if self._waiting else 0
        while self._waiting:
            stamp, sample = self._waiting[0]
            newest = self._readings[-1][0] if self._readings else None
            silent = newest is None or newest_sample - newest > self._patience
            if not silent and newest is not None and newest < stamp:
                break
            self._waiting.popleft()
            found.append((stamp, sample, self._nearest(stamp)))
        return found

    def _nearest(self, stamp: int) -> Reading | None:
        """Return the reading of the nearest stamp; older ones are not needed any more."""
        readings = self._readings
        while len(readings) > 1 and abs(readings[1][0] - stamp) <= abs(readings[0][0] - stamp):
            readings.popleft()
        near = bool(readings) and abs(readings[0][0] - stamp) <= self._patience
        return readings[0][1] if near else None
