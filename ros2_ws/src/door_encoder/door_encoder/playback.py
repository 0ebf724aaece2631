"""Recordings as a counter board would have sent them."""

from pathlib import Path

import numpy as np
from door_model.recording.mcap import COUNTS, SAMPLES, read_batches
from door_model.recording.recording import COUNTS_PER_TURN, Recording, read_csv

from door_encoder.decoding.batch import Batch
from door_encoder.errors import PlaybackError

BATCH = 0.02  # [s] of samples in a batch
_RESOLUTION = 2.0 * np.pi / COUNTS_PER_TURN  # of a recording of angles [rad]


def batches_from_csv(path: str | Path, counts_per_turn: int = COUNTS_PER_TURN) -> list[Batch]:
    """Batches of a CSV file.

    Raises:
        DoorModelError: It cannot be read.
        PlaybackError: See `batches`.
    """
    return batches(read_csv(path, counts_per_turn))


def batches_from_mcap(path: str | Path) -> list[Batch]:
    """Batches of an MCAP file as they were: raw counts if they are there, else samples.

    Raises:
        DoorModelError: It cannot be read, or has neither topic.
    """
    _, recorded = read_batches(path, (COUNTS, SAMPLES))
    return [
        Batch(
            one.stamp_ns,
            one.period,
            one.first_index,
            one.counts_per_turn,
            one.counts,
            one.gap_before,
            one.index_counts,
        )
        for one in recorded
    ]


def batches(recording: Recording) -> list[Batch]:
    """Cut a recording into batches of 20 ms, numbered by the time between samples.

    Raises:
        PlaybackError: There are fewer than two samples, or they are not evenly spaced: each must
            follow the one before by a whole number of periods, to half a period.
    """
    t = recording.t
    if len(t) < 2:
        raise PlaybackError(
            f"a recording of {len(t)} samples has no period", value=len(t), limit=2
        )
    periods = np.diff(t)
    usual = np.median(periods)
    period = float(periods[np.abs(periods - usual) < 0.5 * usual].mean())  # without the gaps
    steps = np.rint(periods / period).astype(np.int64)
    if not steps.all():
        at = int(np.argmin(steps))
        raise PlaybackError(
            f"samples are not evenly spaced: {periods[at]:g} s at {t[at]:g} s, elsewhere "
            f"{period:g} s",
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
                Batch(
                    stamp_ns=round(t[at] * 1e9),
                    period=period,
                    first_index=int(numbers[at]),
                    counts_per_turn=round(2.0 * np.pi / resolution),
                    values=counts[part[start : start + size]],
                    gap_before=at > 0 and start == 0,
                )
            )
    return found
