"""Recordings become the batches that a counter board would have sent."""

from pathlib import Path

import numpy as np
from door_model.recording.batch import SampleBatch
from door_model.recording.mcap import COUNTS, SAMPLES, read_batches
from door_model.recording.recording import COUNTS_PER_TURN, Recording, read_csv

from door_encoder.errors import PlaybackError

BATCH = 0.02  # duration of a batch [s]
_RESOLUTION = 2.0 * np.pi / COUNTS_PER_TURN  # angle of a count where a recording has angles [rad]


def batches_from_csv(path: str | Path, counts_per_turn: int = COUNTS_PER_TURN) -> list[SampleBatch]:
    """Read the batches of a CSV file.

    Raises:
        DoorModelError: The file cannot be read.
        PlaybackError: The samples cannot be cut into batches, as in `batches`.
    """
    return batches(read_csv(path, counts_per_turn))


def batches_from_mcap(path: str | Path) -> list[SampleBatch]:
    """Read the batches of an MCAP file as they were sent: raw counts if recorded, else samples.

    Raises:
        DoorModelError: The file cannot be read, or contains neither topic.
    """
    return read_batches(path, (COUNTS, SAMPLES))[1]


def batches(recording: Recording) -> list[SampleBatch]:
    """Cut a recording into batches of 20 ms whose running numbers follow from the sample times.

    Raises:
        PlaybackError: There are fewer than two samples, or they are not evenly spaced: the time
            between two samples must be a whole number of periods, to half a period.
    """
    t = recording.t
    if len(t) < 2:
        raise PlaybackError(
            f"a recording of {len(t)} samples has no period, at least 2 samples are needed",
            quantity="number of samples",
            value=len(t),
            limit=2,
        )
    periods = np.diff(t)
    usual = np.median(periods)
    period = float(periods[np.abs(periods - usual) < 0.5 * usual].mean())  # without the gaps
    steps = np.rint(periods / period).astype(np.int64)
    if not steps.all():
        at = int(np.argmin(steps))
        raise PlaybackError(
            f"the samples are not evenly spaced: {periods[at]:g} s at {t[at]:g} s, elsewhere "
            f"{period:g} s",
            quantity="time between two samples [s]",
            value=float(periods[at]),
            limit=period,
        )
    numbers = np.concatenate([[0], np.cumsum(steps)])
    resolution = recording.resolution or _RESOLUTION
    counts = np.rint(recording.theta / resolution).astype(np.int64)
    size = max(1, round(BATCH / period))
    found = []
    for part in np.split(np.arange(len(t)), np.flatnonzero(steps > 1) + 1):
        for start in range(0, len(part), size):
            at = int(part[start])
            found.append(
                SampleBatch(
                    stamp_ns=round(t[at] * 1e9),
                    period=period,
                    first_index=int(numbers[at]),
                    counts_per_turn=round(2.0 * np.pi / resolution),
                    counts=counts[part[start : start + size]],
                    gap_before=at > 0 and start == 0,
                )
            )
    return found
