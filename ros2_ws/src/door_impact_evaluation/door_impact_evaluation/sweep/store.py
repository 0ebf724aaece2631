"""Store the runs of a sweep in one Parquet file, with the versions of the software."""

import fcntl
import hashlib
import os
import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path

import numpy as np
import pinocchio
import pyarrow as pa
import pyarrow.parquet as pq
from door_impact_common.files import make_folder, write_whole

from door_impact_evaluation.errors import EvaluationError
from door_impact_evaluation.sweep.kind import Row

NAME = "runs.parquet"


@cache
def versions(engine: str) -> Row:
    """Return the versions that a run depends on; the engine's package has the engine's name."""
    return {"numpy_version": np.__version__, "pinocchio_version": pinocchio.__version__,
            "engine_version": metadata.version(engine), "commit": _commit()}


def _commit() -> str | None:
    """Return the checkout's commit and a digest of what was changed since; None without one."""
    def git(*arguments: str) -> bytes:
        return subprocess.run(["git", *arguments], cwd=Path(__file__).resolve().parent,
                              capture_output=True, check=True).stdout

    try:
        commit, changes = git("rev-parse", "HEAD"), git("diff", "HEAD", "--", ":/ros2_ws/src")
    except (OSError, subprocess.CalledProcessError):
        return None
    return commit.decode().strip() + (
        f"+{hashlib.sha256(changes).hexdigest()[:12]}" if changes else "")


class Runs:
    """All rows of a folder's `NAME`, whichever sweep they are of; one process at a time has it.

    Args:
        folder: The folder, which is made if need be.

    Attributes:
        path: The file.
        rows: Rows by their column "id", which stands for case, kind, engine and versions.

    Raises:
        EvaluationError: Another sweep has the folder, or the file is no Parquet file of runs.
        OutputError: The folder cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self.path = make_folder(folder) / NAME
        self.rows: dict[str, list[Row]] = {}
        self._folder = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(self._folder, fcntl.LOCK_EX | fcntl.LOCK_NB)  # until the process ends
            if self.path.exists():
                # ParquetFile takes the path as it is; read_table makes columns of folders like a=1.
                for row in pq.ParquetFile(self.path).read().to_pylist():
                    self.rows.setdefault(row["id"], []).append(row)
        except BlockingIOError as error:
            self.close()
            raise EvaluationError(f"another sweep writes to {folder}") from error
        except (pa.ArrowException, KeyError) as error:
            self.close()
            raise EvaluationError(f"{self.path} is no file of runs: {error}") from error

    def close(self) -> None:
        """Let other processes have the folder."""
        os.close(self._folder)

    def put(self, key: str, rows: list[Row]) -> None:
        """Write rows, in the place of those of the same id.

        Raises:
            EvaluationError: A value does not fit the column that the file has already.
            OutputError: The file cannot be written; it is as it was.
        """
        self.rows[key] = rows
        every = [row for rows in self.rows.values() for row in rows]
        columns = dict.fromkeys(name for row in every for name in row)
        content = pa.BufferOutputStream()
        try:
            pq.write_table(
                pa.table({name: [row.get(name) for row in every] for name in columns}), content)
        except pa.ArrowException as error:
            raise EvaluationError(f"the runs do not fit those in {self.path}: {error}") from error
        write_whole(self.path, content.getvalue().to_pybytes())
