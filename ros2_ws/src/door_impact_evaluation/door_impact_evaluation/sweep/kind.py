"""What a kind of sweep declares. Running, storing, statistics and report are the same for all."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from door_impact_evaluation.sweep.numbers import Statistic

Row = dict[str, Any]
"""A run by the names of its columns: numbers, texts, truth values, None, and lists of them."""


class Panel(NamedTuple):
    """A drawing of column y over column x, or of x's distribution; limits of y become lines."""

    x: str
    y: str = ""
    limits: tuple[float, ...] = ()


@dataclass(frozen=True)
class Kind:
    """A kind of sweep.

    A case is everything that is drawn for one or several runs. It becomes the first columns of
    their rows, among them "group", "index" within the group, and "seed" of the sensors' noise.

    Attributes:
        name: Name of the kind.
        what: What the sweep does, for the command's help.
        draw: Draws the cases for the number of cases in each group and a seed; a longer sweep of
            the same seed contains those of a shorter one.
        run: Simulates a case in the physics engine of its column "engine", and yields what was
            measured of each run: "stood", "fell" (why, or empty), "margin_mm" and more.
        label: Names the group of runs in which a row is summarized, by columns of its case.
        summary: Computes the figures of summary.json that only this kind has, or has otherwise.
        counts: Columns that are true or false, of which the true ones are counted.
        measures: Columns that are summarized over the runs in which the robot stood.
        worst: Column whose largest sizes are the worst runs.
        panels: The figure; the report gives the x of each for the worst runs.
    """

    name: str
    what: str
    draw: Callable[[int, int], list[Row]]
    run: Callable[[Row], Iterator[Row]]
    label: Callable[[Row], str]
    summary: Callable[[list[Row]], Row]
    counts: tuple[str, ...]
    measures: Mapping[str, Statistic]
    worst: str
    panels: tuple[Panel, ...]


def count(rows: list[Row], column: str) -> int:
    """Count the rows whose value in a column is neither unknown nor false."""
    return sum(bool(row.get(column)) for row in rows)
