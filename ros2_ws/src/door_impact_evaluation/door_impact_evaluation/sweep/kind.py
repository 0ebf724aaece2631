"""Define what a kind of sweep declares, and the statistics of its figures.

Running, storing and the report are the same for all kinds. What is not known is None or NaN, and
left out of statistics.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel

Figure = float | None
Statistic = Callable[[Iterable[Figure]], dict[str, Figure]]
"""Function that summarizes figures; each of its values is None if no figure is known."""

Row = dict[str, Any]
"""A run by the names of its columns: numbers, texts, truth values, None, and lists of them."""


def robot_of(case: Row) -> RobotModel:
    """Return the robot of a case's column "robot", a robot.yaml; empty, or without it: HRP-2."""
    return _robot(case.get("robot", ""))


@lru_cache(maxsize=1)
def _robot(path: str) -> RobotModel:
    return RobotModel(load_robot_config(path or None))


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


def known(values: Iterable[Figure]) -> Array:
    """Return the figures that are known, (n,)."""
    return np.array([value for value in values if value is not None and math.isfinite(value)],
                    dtype=float)


def smallest(values: Iterable[Figure]) -> dict[str, Figure]:
    """Compute the 5th percentile and the minimum of margins."""
    return _of(known(values), p5=lambda found: np.percentile(found, 5.0), min=np.min)


def largest(values: Iterable[Figure]) -> dict[str, Figure]:
    """Compute the 95th percentile and the maximum of sizes."""
    return _of(np.abs(known(values)), p95=lambda found: np.percentile(found, 95.0), max=np.max)


def statistics(errors: Iterable[Figure]) -> dict[str, Figure]:
    """Compute mean and standard deviation of errors, 95th percentile and maximum of their sizes."""
    found = known(errors)
    sd = partial(np.std, ddof=min(1, len(found) - 1))  # of a single error it is 0
    return {**_of(found, mean=np.mean, sd=sd), **largest(found)}


def _of(found: Array, **statistics: Callable[[Array], Any]) -> dict[str, Figure]:
    return {name: float(of(found)) if len(found) else None for name, of in statistics.items()}
