"""Draws the figure of a sweep as a grid of panels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from door_impact_common.palette import BLUE, GREEN, GREY, ORANGE, VERMILION

from door_impact_evaluation.sweep.kind import Record
from door_impact_evaluation.sweep.numbers import Figure, is_known

_STYLES = ((BLUE, "o"), (ORANGE, "x"), (GREEN, "^"))  # colour and marker of each group
_FELL = "s"  # marker around a run that fell
_SIZE = (3.6, 2.9)  # of a panel [inch]


@dataclass(frozen=True)
class Panel:
    """A figure of each run over another one.

    Attributes:
        x_label: Name of the figure to the right.
        y_label: Name of the figure upwards.
        x: The figure to the right of a record; None where it is not known.
        y: The figure upwards of a record; None where it is not known.
        limits: Values of y that are to be kept, each drawn as a line.
    """

    x_label: str
    y_label: str
    x: Callable[[Record], Figure]
    y: Callable[[Record], Figure]
    limits: tuple[float, ...] = ()


def draw(
    panels: Sequence[Panel], groups: dict[str, list[Record]], path: Path, columns: int = 2
) -> None:
    """Draws panels, with runs that fell marked.

    Args:
        panels: The panels, row by row.
        groups: Records by the name of their group.
        path: Picture to write.
        columns: Panels in a row.
    """
    rows = -(-len(panels) // columns)
    drawing, axes = plt.subplots(
        rows, columns, figsize=(_SIZE[0] * columns, _SIZE[1] * rows + 0.4), layout="constrained",
        squeeze=False)
    labels: dict[str, Any] = {}
    around: Any = None
    for axis, panel in zip(axes.flat, panels, strict=False):
        for (name, records), (color, mark) in zip(groups.items(), _STYLES, strict=False):
            points = [(panel.x(r), panel.y(r), r["stood"]) for r in records if "refused" not in r]
            shown = [(x, y, stood) for x, y, stood in points if is_known(x) and is_known(y)]
            x, y, stood = (np.array(column) for column in zip(*shown, strict=True)) if shown else (
                np.empty(0), np.empty(0), np.empty(0, dtype=bool))
            labels[name], = axis.plot(x, y, mark, color=color, markersize=4.5)
            fell = ~stood.astype(bool)
            if fell.any():
                around, = axis.plot(
                    x[fell], y[fell], _FELL, color=VERMILION, markersize=8.5, fillstyle="none")
        for limit in panel.limits:
            axis.axhline(limit, color=GREY, linewidth=1.0, linestyle="--")
        axis.set(xlabel=panel.x_label, ylabel=panel.y_label)
    for unused in axes.flat[len(panels):]:
        unused.set_axis_off()
    if around is not None:
        labels["fell"] = around
    drawing.legend(list(labels.values()), list(labels), loc="outside upper center",
                   ncols=len(labels), fontsize=9)
    drawing.savefig(path, dpi=110)
    plt.close(drawing)
