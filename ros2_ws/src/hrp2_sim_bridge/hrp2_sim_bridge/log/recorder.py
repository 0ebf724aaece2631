"""Columns of numbers that grow up to a bound, and the file to which they are written."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.errors import OutputError, SettingError
from door_impact_common.files import make_folder
from numpy.typing import ArrayLike, NDArray

_FIRST_CAPACITY = 4096  # number of rows for which there is room at the start
_LEAST_ROWS = 16  # smallest bound on the number of rows


class Recorder:
    """Named columns that grow row by row; beyond a bound the older half is deleted.

    Args:
        columns: Shape and dtype of one row of each column, by the column's name.
        most_rows: Bound on the number of rows.
    """

    def __init__(self, columns: Mapping[str, tuple[tuple[int, ...], str]], most_rows: int) -> None:
        self._most = max(_LEAST_ROWS, most_rows)
        capacity = min(_FIRST_CAPACITY, self._most)
        self._data: dict[str, NDArray] = {
            name: np.zeros((capacity, *shape), dtype=kind)
            for name, (shape, kind) in columns.items()
        }
        self._rows = 0
        self._capacity = capacity

    def __len__(self) -> int:
        return self._rows

    def add(self, count: int, **rows: ArrayLike) -> None:
        """Append rows.

        Args:
            count: Number of rows, at most half of the bound.
            rows: Rows of every column, by the column's name.
        """
        while self._rows + count > self._capacity:
            self._make_room()
        for name, data in self._data.items():
            data[self._rows : self._rows + count] = rows[name]
        self._rows += count

    def arrays(self) -> dict[str, NDArray]:
        """Return copies of the columns."""
        return {name: data[: self._rows].copy() for name, data in self._data.items()}

    def clear(self) -> None:
        """Delete every row."""
        self._rows = 0

    def _make_room(self) -> None:
        if self._capacity >= self._most:
            keep = self._most - self._most // 2
            for data in self._data.values():
                data[:keep] = data[self._rows - keep : self._rows].copy()
            self._rows = keep
            return
        self._capacity = min(2 * self._capacity, self._most)
        for name, data in self._data.items():
            grown = np.zeros((self._capacity, *data.shape[1:]), dtype=data.dtype)
            grown[: self._rows] = data[: self._rows]
            self._data[name] = grown


def check_writable(path: str | Path) -> None:
    """Check before a run that `save_npz` can write its log afterwards.

    Raises:
        SettingError: The path is no file's name, or the file cannot be written.
    """
    target = Path(path)
    try:
        partial = target.with_name(target.name + ".part")
        partial.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(b"")
        partial.unlink()
    except (OSError, ValueError) as error:
        raise SettingError("log_file", path, f"a file that can be written ({error})") from error


def save_npz(path: str | Path, arrays: Mapping[str, ArrayLike]) -> Path:
    """Write an npz file that appears completely or not at all.

    The file is not compressed, because a node that ends has little time.

    Args:
        path: File; its suffix is replaced by npz. Missing folders are made.
        arrays: Arrays by their names in the file.

    Returns:
        Path of the written file.

    Raises:
        OutputError: The file cannot be written; an older file is left as it was.
    """
    target = Path(path).with_suffix(".npz")
    make_folder(target.parent)
    partial = target.with_name(target.name + ".part")
    columns: dict[str, Any] = {name: np.asarray(data) for name, data in arrays.items()}
    try:
        with partial.open("wb") as stream:
            np.savez(stream, **columns)
        partial.replace(target)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(
            f"{target} cannot be written: {error.strerror}", value=str(target)) from error
    return target
