"""Folder of results: a new run replaces the results of the run before as a whole, or not at all."""

import shutil
from pathlib import Path

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

    def begin(self) -> None:
        """Makes an empty folder for a new run; the results of the run before stay untouched.

        Raises:
            OutputError: The folder cannot be made.
        """
        shutil.rmtree(self.unfinished, ignore_errors=True)
        make_folder(self.unfinished)

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
