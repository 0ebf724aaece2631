"""Recordings of the door's angle, read from CSV files and written to them.

The header of a file is ``time_s,count`` or ``time_s,angle_deg``; swings need not be separated.
"""

import csv
import math
from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
from door_impact_common.errors import InputError
from door_impact_common.files import read_file, shown, write_whole
from numpy.typing import NDArray

from door_model.errors import BadRecordingError, DoorParameterError

COUNTS_PER_TURN = 14400  # counts in a turn of the paper's encoder: 3600 lines, quadrature
_COUNT_HEADER = ["time_s", "count"]
_ANGLE_HEADER = ["time_s", "angle_deg"]


@dataclass(frozen=True)
class Recording:
    """Opening angle over time.

    Attributes:
        t: Sample times, strictly increasing, (N,) [s].
        theta: Opening angles (N,) [rad].
        resolution: Angle of one count of the encoder [rad]; 0 if it is not known.

    Raises:
        DoorParameterError: The shapes differ, a value is not finite, or times do not increase.
    """

    t: NDArray[np.float64]
    theta: NDArray[np.float64]
    resolution: float = 0.0

    def __post_init__(self) -> None:
        """Check shapes and times."""
        if self.t.ndim != 1 or self.t.shape != self.theta.shape:
            raise DoorParameterError(
                "theta's shape", self.theta.shape, f"(N,) as t's {self.t.shape}"
            )
        if not (np.isfinite(self.t).all() and np.isfinite(self.theta).all()):
            raise DoorParameterError("values of a recording", "NaN or infinity", "finite numbers")
        if (np.diff(self.t) <= 0.0).any():
            raise DoorParameterError(
                "times of a recording", "constant or decreasing", "increasing")


def from_counts(
    t: NDArray[np.float64], counts: NDArray[np.int64], counts_per_turn: int = COUNTS_PER_TURN
) -> Recording:
    """Make a recording from encoder counts.

    Args:
        t: Sample times, strictly increasing, (N,) [s].
        counts: Counts, zero at the closed door, (N,).
        counts_per_turn: Number of counts in a turn of the hinge.

    Raises:
        DoorParameterError: counts_per_turn is not positive, or the samples are not those of a
            `Recording`.
    """
    if counts_per_turn <= 0:
        raise DoorParameterError("counts_per_turn", counts_per_turn, "a positive number")
    resolution = 2.0 * math.pi / counts_per_turn
    return Recording(np.asarray(t, float), np.asarray(counts, float) * resolution, resolution)


def read_csv(
    path: str | Path,
    counts_per_turn: int = COUNTS_PER_TURN,
) -> Recording:
    """Read a recording from a CSV file.

    Args:
        path: The file.
        counts_per_turn: Number of counts in a turn of the hinge; it is only used with the header
            time_s,count.

    Raises:
        BadRecordingError: The file cannot be read; the error names the line. Only of a file with
            a recording's header is a line in the message.
        DoorParameterError: counts_per_turn is not positive.
    """
    source = shown(path)
    try:
        text = read_file(path).decode("utf-8-sig")
    except InputError as error:
        raise BadRecordingError(
            source, None, error.problem, value=source, limit="a readable file") from error
    except UnicodeDecodeError as error:
        raise BadRecordingError(
            source, None, "is not a text in UTF-8", value=source, limit="a text in UTF-8"
        ) from error
    rows = csv.reader(StringIO(text, newline=""))
    try:
        header = [cell.strip() for cell in next(rows, [])]
        if header not in (_COUNT_HEADER, _ANGLE_HEADER):
            wanted = "time_s,count or time_s,angle_deg"
            raise BadRecordingError(
                source, 1, f"the header must be {wanted}", value=header, limit=wanted)
        t, values = _columns(source, rows, counts=header == _COUNT_HEADER)
    except csv.Error as error:
        raise BadRecordingError(
            source, rows.line_num, f"is no CSV: {error}", value=source, limit="lines of CSV"
        ) from error
    if header == _COUNT_HEADER:
        return from_counts(t, values.astype(np.int64), counts_per_turn)
    return Recording(t, np.radians(values))


def _columns(
    source: str, rows: Iterable[list[str]], *, counts: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return both columns of a file, checked line by line."""
    t, values = array("d"), array("d")
    for line, row in enumerate(rows, start=2):
        if not row:
            continue
        if len(row) != 2:
            raise BadRecordingError(
                source, line, f"has {len(row)} fields, not 2", value=row, limit=2
            )
        try:
            time, value = float(row[0]), float(row[1])
        except ValueError:
            raise BadRecordingError(
                source, line, f"{shown(','.join(row))!r} is not a number", value=row,
                limit="two numbers",
            ) from None
        if not (math.isfinite(time) and math.isfinite(value)):
            raise BadRecordingError(
                source, line, f"{shown(','.join(row))!r} is not finite", value=row,
                limit="two numbers",
            )
        if counts and value != int(value):
            raise BadRecordingError(
                source, line, f"count {value:g} is not a whole number", value=value,
                limit="a whole number",
            )
        if t and time <= t[-1]:
            raise BadRecordingError(
                source, line, f"time {time} s does not follow {t[-1]} s", value=time, limit=t[-1]
            )
        t.append(time)
        values.append(value)
    if not t:
        raise BadRecordingError(source, None, "has no samples", value=0, limit=1)
    return np.array(t), np.array(values)


def write_counts_csv(path: str | Path, t: NDArray[np.float64], counts: NDArray[np.int64]) -> None:
    """Write a recording of counts to a CSV file, which appears complete or not at all.

    Args:
        path: The file.
        t: Sample times (N,) [s].
        counts: Counts, zero at the closed door, (N,).

    Raises:
        OutputError: The file cannot be written.
    """
    lines = ["time_s,count"]
    lines += [
        f"{time:.6f}".rstrip("0").rstrip(".") + f",{count}"
        for time, count in zip(t, counts, strict=True)
    ]
    write_whole(path, "\n".join(lines) + "\n")
