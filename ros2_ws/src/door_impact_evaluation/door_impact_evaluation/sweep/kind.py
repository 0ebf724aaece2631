"""The interface of a kind of sweep: what is run, what is measured, and how it is shown."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from door_impact_view.replay.recording import Replay

Record = dict[str, Any]
"""What was measured of a run, as JSON has it: "name" is that of its case."""
REPLAYS = "replays"
"""Folder of the replays below that of the sweep's results."""


class Case(Protocol):
    """One set of perturbations with its runs; hashable, and the same for the same seed."""

    @property
    def name(self) -> str:
        """Name of the case, unique within a sweep."""

    def as_json(self) -> dict[str, Any]:
        """Returns everything that determines the case's runs, as it is written to a record."""


@dataclass(frozen=True)
class BadRun:
    """A run that is worth looking at.

    Attributes:
        name: Name of the case.
        number: Number of the run within its case, from 0.
        why: What is bad about it.
        file: Name of its replay in `REPLAYS`.
    """

    name: str
    number: int
    why: str
    file: str


class Kind(ABC):
    """A kind of sweep. An instance has no state, so that it can be sent to other processes.

    Attributes:
        name: Name of the kind.
        unit: What a case is called.
        part: What a run of a case is called; in records it is the key of the run's number.
        what: What the sweep does, for the command's help.
    """

    name: str
    unit: str
    part: str
    what: str

    @abstractmethod
    def cases(self, n: int, seed: int) -> list[Any]:
        """Draws the cases; a longer sweep of the same seed contains those of a shorter one.

        Args:
            n: Number of cases in each group that is drawn.
            seed: Seed of the random numbers.
        """

    @abstractmethod
    def run(self, case: Any, engine: str) -> list[Record]:
        """Simulates the runs of a case.

        Args:
            case: One of `cases`.
            engine: Physics engine of the simulation.

        Returns:
            One record for each run; numbers that are not known may be NaN.
        """

    @abstractmethod
    def numbers(self, records: list[Record]) -> dict[str, Any]:
        """Computes the figures of summary.json, "stood" and "min_margin_mm" among them.

        Args:
            records: Records of all cases.
        """

    @abstractmethod
    def worst(self, records: list[Record]) -> list[BadRun]:
        """Chooses the runs with a replay.

        Args:
            records: Records of all cases.
        """

    @abstractmethod
    def table(self, found: dict[str, Any]) -> str:
        """Formats the results as a table for a terminal.

        Args:
            found: Contents of summary.json.
        """

    @abstractmethod
    def figure(self, found: dict[str, Any], path: Path) -> None:
        """Draws the results.

        Args:
            found: Contents of summary.json.
            path: Picture to write.
        """

    @abstractmethod
    def replay(self, case: Any, engine: str, number: int) -> Replay:
        """Simulates a run again, and makes its replay.

        Args:
            case: Its case.
            engine: Physics engine of the simulation.
            number: Number of the run within its case, from 0.
        """


def bad_runs(kind: Kind, reasons: list[tuple[Record, str]]) -> list[BadRun]:
    """Returns the runs of some reasons; one with several of them is named once, with all.

    Args:
        kind: The kind of the sweep.
        reasons: Records of runs and what is bad about each.
    """
    found: dict[tuple[str, int], list[str]] = {}
    for record, why in reasons:
        found.setdefault((record["name"], record[kind.part]), []).append(why)
    return [BadRun(name, number, "; ".join(whys), f"{name}-{kind.part}{number + 1}.html")
            for (name, number), whys in found.items()]


def replay_lines(found: dict[str, Any]) -> list[str]:
    """Returns the lines of a table that name the replays.

    Args:
        found: Contents of summary.json.
    """
    if not found["replays"]:
        return []
    return ["", f"replays, in {REPLAYS}/",
            *(f"  {bad['file']}: {bad['why']}" for bad in found["replays"])]
