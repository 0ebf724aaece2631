"""Folder of results: a new run replaces the results of the run before as a whole, or not at all."""

import fcntl
import os
import shutil
from pathlib import Path

from door_impact_common.errors import OutputError
from door_impact_common.files import make_folder

from door_impact_evaluation.report import report

LOG = "nodes.log"
UNFINISHED = "unfinished_run"
"""Folder inside the folder of results, in which a run writes until its results are complete."""


class ResultFolder:
    """The folder of a demonstration's results.

    Attributes:
        path: The folder.
        unfinished: Folder inside it for the files of a run that has no results yet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.unfinished = path / UNFINISHED
        self._lock: int | None = None  # descriptor of the folder, whose lock ends with the process

    def begin(self) -> None:
        """Makes an empty folder for a new run; the results of the run before stay untouched.

        Raises:
            OutputError: The folder cannot be made, or another run writes to it.
        """
        self._lock = os.open(make_folder(self.path), os.O_RDONLY)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise OutputError(
                f"another run writes to the folder {self.path}: wait for its end, or choose "
                "another folder with --out", value=str(self.path)) from error
        shutil.rmtree(self.unfinished, ignore_errors=True)
        make_folder(self.unfinished)

    def release(self) -> None:
        """Lets other runs write to the folder."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def is_complete(self) -> bool:
        """Reports whether the new run has written its results; summary.json is written last."""
        return (self.unfinished / "summary.json").exists()

    def replace(self) -> None:
        """Puts the results of the new run in the place of those of the run before.

        A file that the new run did not write is removed: no old file may pass for a new result.
        """
        for name in (*report.FILES, LOG):
            new = self.unfinished / name
            if new.exists():
                new.replace(self.path / name)
            else:
                (self.path / name).unlink(missing_ok=True)
        shutil.rmtree(self.unfinished)
