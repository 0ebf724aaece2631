"""Recordings of the door's angle, read from CSV files and written to them.

A file has the columns ``time_s`` and ``count`` or ``angle_deg``; swings need not be separated.
"""

import codecs
import csv
import math
import re
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path

import numpy as np
from door_impact_common.errors import InputError
from door_impact_common.files import read_file, shown, write_whole
from numpy.typing import NDArray

from door_model.errors import BadRecordingError, DoorParameterError
from door_model.recording.counts import LARGEST_COUNT
from door_model.recording.sensor import opening

COUNTS_PER_TURN = 14400  # counts in a turn of the paper's encoder: 3600 lines, quadrature
_VALUES = ("count", "angle_deg")
# Ranges of clocks [s]: of so many bits that count microseconds to milliseconds.
_CLOCKS = tuple(2**bits / rate for bits in (16, 24, 31, 32) for rate in (1e6, 1e5, 1e4, 1e3))
_LONGEST_STEP = 10.0  # longest step with which a clock begins anew [steps]
# Thousands are separated by blanks or apostrophes, by one decimal sign before another, ...
_GROUPED = re.compile(r"\d['’\s]\d{3}|\d[.,]\d{3}[.,]")
_ROUNDED = re.compile(r"[-+]?\d\.\d\de\+?0*[1-9]\d*", re.IGNORECASE)  # 1.25E+01
_GROUPED_COUNT = re.compile(r"[1-9][.,]\d{3}$|[1-9]\d{1,2}[.,]\d{3}$")  # ... or in whole numbers


@dataclass(frozen=True)
class Recording:
    """Opening angle over time.

    Attributes:
        t: Sample times, strictly increasing, (N,) [s].
        theta: Opening angles (N,) [rad].
        resolution: Angle of one count of the encoder [rad]; 0 if it is not known.
        assumptions: What was assumed to get these angles from what the sensor shows.

    Raises:
        DoorParameterError: The shapes differ, a value is not finite, or times do not increase.
    """

    t: NDArray[np.float64]
    theta: NDArray[np.float64]
    resolution: float = 0.0
    assumptions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Convert lists to arrays, and check shapes and times."""
        for name in ("t", "theta"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), float))
        if self.t.ndim != 1 or self.t.shape != self.theta.shape:
            raise DoorParameterError(
                "theta's shape", self.theta.shape, f"(N,) as t's {self.t.shape}")
        if not (np.isfinite(self.t).all() and np.isfinite(self.theta).all()):
            raise DoorParameterError("values of a recording", "NaN or infinity", "finite numbers")
        if (np.diff(self.t) <= 0.0).any():
            raise DoorParameterError(
                "times of a recording", "constant or decreasing", "increasing")


def from_counts(
    t: NDArray[np.float64], counts: NDArray[np.int64],
    counts_per_turn: int | None = COUNTS_PER_TURN, *, raw: bool = False, own_zero: bool = True,
) -> Recording:
    """Make a recording from encoder counts.

    Args:
        t: Sample times, strictly increasing, (N,) [s].
        counts: Counts, zero at the closed door, or raw ones, (N,).
        counts_per_turn: Number of counts in a turn of the hinge; None: `COUNTS_PER_TURN` is
            assumed.
        raw: Whether the counts are to be unwrapped, zeroed and turned by `sensor.opening`.
        own_zero: Whether the zero of raw counts is believed if the door rests near it.

    Raises:
        DoorParameterError: counts_per_turn is not positive, or the samples are not those of a
            `Recording`.
        BadRecordingError: The count wraps as that of another sensor than the assumed one.
    """
    turn = COUNTS_PER_TURN if counts_per_turn is None else counts_per_turn
    if turn <= 0:
        raise DoorParameterError("counts_per_turn", turn, "a positive number")
    t, counts, resolution = np.asarray(t, float), np.asarray(counts), 2.0 * math.pi / turn
    if counts.ndim != 1 or t.shape != counts.shape or not len(t):
        raise DoorParameterError("counts' shape", counts.shape, f"(N,) as t's {t.shape}, N > 0")
    if counts.dtype.kind not in "iu" or counts.max() > LARGEST_COUNT:
        raise DoorParameterError(
            "counts", f"{counts.dtype} up to {counts.max()}", f"integers up to {LARGEST_COUNT}")
    counts = counts.astype(np.int64)  # differences of unsigned ones would wrap
    if raw:
        given = counts_per_turn is not None
        theta, assumptions = opening(t, counts, turn, given=given, own_zero=own_zero)
        return Recording(t, theta, resolution, assumptions)
    return Recording(
        t, counts.astype(float) * resolution, resolution, (f"{turn} counts per turn",))


def read_csv(path: str | Path, counts_per_turn: int | None = None) -> Recording:
    """Read a recording from a CSV file, as a logger or a spreadsheet writes it.

    The columns are separated by commas, semicolons or tabs; other columns are ignored, and so are
    lines that begin with #. Decimal commas are read where commas separate no columns.

    Args:
        path: The file.
        counts_per_turn: Number of counts in a turn of the hinge; None: `COUNTS_PER_TURN`. It is
            only used with a column count.

    Raises:
        BadRecordingError: The file cannot be read; the error names the line. Only of a file with
            a recording's header is a line in the message.
        DoorParameterError: counts_per_turn is not positive.
    """
    source = shown(path)
    try:
        content = read_file(path)
        wide = content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        text = content.decode("utf-16" if wide else "utf-8-sig")
    except InputError as error:
        raise BadRecordingError(
            source, None, error.problem, value=source, limit="a readable file") from error
    except UnicodeDecodeError as error:
        raise BadRecordingError(
            source, None, "is not a text in UTF-8", value=source, limit="a text in UTF-8"
        ) from error
    lines = StringIO(text, newline=None).readlines()
    begin, names, separator = _header(source, lines)
    rows = csv.reader(("" if line.lstrip().startswith("#") else line for line in lines[begin:]),
                      delimiter=separator)
    kind = next(name for name in _VALUES if name in names)
    t, values, marks, places = array("d"), array("d"), set[str](), array("q")
    said: tuple[str, ...] = ()
    try:
        for row in rows:
            if not any(cell.strip() for cell in row):
                continue
            try:
                time, value = _numbers(row, names, kind, marks, commas=separator != ",")
            except ValueError as error:
                last = not "".join(lines[begin + rows.line_num :]).strip()
                if t and last and (len(row) < len(names) or not lines[-1].endswith("\n")):
                    said = ("the last line was left out, since it was cut off",)
                    break
                raise BadRecordingError(
                    source, begin + rows.line_num, str(error), value=row,
                    limit=f"{len(names)} numbers, finite, in order of time") from None
            t.append(time)
            values.append(value)
            places.append(begin + rows.line_num)
    except csv.Error as error:
        raise BadRecordingError(
            source, begin + rows.line_num, f"is no CSV: {error}", value=source,
            limit="lines of CSV") from error
    if not t:
        raise BadRecordingError(source, None, "has no samples", value=0, limit=1)
    times, wraps = _unwrapped(np.array(t))
    _require_order(source, times, places, lines)
    if kind == "count":
        counts = np.array(values).astype(np.int64)
        found = from_counts(times, counts, counts_per_turn, raw=True)
    else:
        theta, assumptions = opening(times, np.array(values), None)
        found = Recording(times, theta, assumptions=assumptions)
    return replace(found, assumptions=(*found.assumptions, *wraps, *said))


def _unwrapped(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Return times without the leaps of a clock that begins anew at its range, and its range."""
    steps = np.diff(t)
    back = steps < 0.0
    for modulus in _CLOCKS if back.any() else ():
        longest = _LONGEST_STEP * np.median(np.abs(steps))
        if np.ptp(t) <= modulus and (np.abs(steps[back] + modulus) <= longest).all():
            ahead = np.concatenate([[0.0], np.cumsum(back)])
            return t - t[0] + ahead * modulus, (f"the times wrap at {modulus:.10g} s",)
    return t, ()


def _require_order(
    source: str, t: NDArray[np.float64], places: Sequence[int], lines: Sequence[str]
) -> None:
    """Raise BadRecordingError if times do not increase."""
    steps = np.diff(t)
    wrong = np.flatnonzero(steps <= 0.0)
    if not wrong.size:
        return
    first = int(wrong[0]) + 1
    problem = f"time {t[first]:.10g} s does not follow {t[first - 1]:.10g} s"
    if len(wrong) > 1 and steps.min() == 0.0:
        tick = float(np.min(steps[steps > 0.0], initial=math.inf))
        cause = "the logger's clock is coarse"
        if re.search(r"\de[+-]?\d", lines[places[first] - 1].lower()):
            cause = "a spreadsheet has rounded them"
        problem += (
            f", and {len(wrong)} of {len(t)} times repeat the one before, in steps of {tick:.3g} "
            f"s: {cause}; write times with more digits")
    raise BadRecordingError(
        source, places[first], problem, value=float(t[first]), limit=float(t[first - 1]))


def _header(source: str, lines: list[str]) -> tuple[int, list[str], str]:
    """Return the number of lines up to the header, the names of its columns, and what separates."""
    for number, line in enumerate(lines, start=1):
        separator = next((mark for mark in "\t;" if mark in line), ",")
        names = [name.strip(' \t\n"').lower() for name in line.lstrip(" #").split(separator)]
        if names.count("time_s") == 1 and sum(names.count(name) for name in _VALUES) == 1:
            return number, names, separator
        if line.strip() and not line.lstrip().startswith("#"):
            break
    wanted = "time_s,count or time_s,angle_deg"
    raise BadRecordingError(
        source, number if lines else 1, f"the header must be {wanted}",
        value=names if lines else [], limit=wanted)


def _numbers(
    row: list[str], names: list[str], kind: str, marks: set[str], *, commas: bool
) -> tuple[float, float]:
    """Return time and value of a row; ValueError says what is wrong.

    Args:
        row: The cells.
        names: Names of the columns.
        kind: Name of the column of the value.
        marks: Decimal signs of the rows before, to which those of this row are added.
        commas: Whether a comma may be a decimal sign.
    """
    if len(row) != len(names):
        raise ValueError(f"has {len(row)} fields, not {len(names)}")
    cells = [row[names.index("time_s")], row[names.index(kind)]]
    if any(map(_GROUPED.search, cells)) or (
            kind == "count" and _GROUPED_COUNT.search(cells[1].strip())):
        raise ValueError(
            f"{shown('; '.join(cells))!r} has a thousands separator: write numbers without it")
    marks.update(*(set(",.") & set(cell) for cell in cells))
    if commas and len(marks) > 1:
        raise ValueError("has decimal points and decimal commas")
    text = shown(",".join(cells))
    try:
        time, value = (float(cell.replace(",", ".") if commas else cell) for cell in cells)
    except ValueError:
        raise ValueError(f"{text!r} is not a number") from None
    if not (math.isfinite(time) and math.isfinite(value)):
        raise ValueError(f"{text!r} is not finite")
    if _ROUNDED.fullmatch(cells[1].strip().replace(",", ".")):
        raise ValueError(f"{text!r} is rounded to three digits, as by a spreadsheet: write all")
    if kind == "count" and value != int(value):
        raise ValueError(f"count {value:g} is not a whole number")
    return time, value


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
