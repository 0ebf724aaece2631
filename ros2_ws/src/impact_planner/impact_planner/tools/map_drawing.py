"""Picture of a map with a panel for each door; plans are coloured by v_rB, refusals by limit."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from impact_planner.tools.impact_map import LIMITS, Cell, MapRange

_COLUMNS = 2  # number of panels side by side
_COLOURS = "viridis"  # colour map of v_rB
# Colours of refusals by key of `LIMITS`.
_PALE = {
    "run-up": "#f6cdc4", "balance": "#fbe0c3", "rest": "#e6e6e6", "pushes on": "#c9c9c9",
    "joint": "#dfd6ee", "ending": "#cfe3f5", "reach": "#efe0d0", "bodies": "#f3eebb",
    "grip": "#d9ecd3", "linkage": "#f0d3e4", "request": "#ffffff",
}  # fmt: skip
_HATCH: dict[str, Any] = {"hatch": "////", "edgecolor": "white", "linewidth": 0.0}
_TICKS = 12  # largest number of named angles
_EVERY = (1, 2, 5, 10, 20, 50)  # candidate steps between named angles


def map_picture(over: MapRange, cells: Sequence[Cell]) -> bytes:
    """Draw a map.

    Args:
        over: Ranges of the map.
        cells: All cells of the map.

    Returns:
        The content of a PNG file.
    """
    rows = math.ceil(len(over.doors) / _COLUMNS)
    figure = Figure(figsize=(13.0, 1.9 + 0.9 * rows + 0.36 * rows * len(over.restitutions)),
                    layout="constrained", dpi=120)
    panels = figure.subplots(rows, _COLUMNS, squeeze=False)
    speeds = [cell.v_rb for cell in cells if cell.feasible]
    scale = ScalarMappable(Normalize(min(speeds, default=0.0), max(speeds, default=1.0)), _COLOURS)
    places = _places(cells)
    for axes, door in zip(panels.flat, over.doors, strict=False):
        _draw_door(axes, over, door.name, places, scale)
    for axes in panels.flat[len(over.doors):]:
        axes.set_axis_off()
    figure.colorbar(scale, ax=panels, label=r"speed of B before the hit $v_{rB}$ [m/s]", pad=0.01)
    figure.suptitle("What can be planned, and what stops the rest", fontsize="x-large")
    figure.legend(handles=_legend(places, scale), loc="outside lower center", ncols=4,
                  frameon=False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _places(cells: Sequence[Cell]) -> dict[tuple[str, float, float], dict[str, Cell]]:
    """Cells by door, restitution and angle, then by run-up."""
    found: dict[tuple[str, float, float], dict[str, Cell]] = {}
    for cell in cells:
        found.setdefault((cell.door, cell.restitution, cell.angle), {})[cell.run_up] = cell
    return found


def _face(both: dict[str, Cell], scale: ScalarMappable) -> dict[str, Any]:
    """Style of a place: its colour, and a hatch where only zmp_limited is feasible."""
    mcv50, zmp_limited = both["mcv50"], both["zmp_limited"]
    if mcv50.feasible:
        return {"facecolor": scale.to_rgba(np.asarray(mcv50.v_rb))}
    if zmp_limited.feasible:
        return {"facecolor": scale.to_rgba(np.asarray(zmp_limited.v_rb)), **_HATCH}
    return {"facecolor": _PALE[zmp_limited.limit]}


def _draw_door(
    axes: Any,
    over: MapRange,
    door: str,
    places: dict[tuple[str, float, float], dict[str, Cell]],
    scale: ScalarMappable,
) -> None:
    """Draw a door's panel, with a column for each angle and a row for each restitution."""
    for row, e in enumerate(over.restitutions):
        for column, angle in enumerate(over.angles):
            axes.add_patch(Rectangle(
                (column - 0.5, row - 0.5), 1.0, 1.0, **_face(places[door, e, angle], scale)))
    axes.set(xlim=(-0.5, len(over.angles) - 0.5), ylim=(-0.5, len(over.restitutions) - 0.5))
    every = next((n for n in _EVERY if len(over.angles) <= _TICKS * n), len(over.angles))
    shown = range(0, len(over.angles), every)
    axes.set_xticks(shown, [f"{math.degrees(over.angles[i]):.4g}" for i in shown])
    axes.set_yticks(range(len(over.restitutions)), [f"{e:g}" for e in over.restitutions])
    axes.set_xticks(np.arange(0.5, len(over.angles) - 1.0), minor=True)
    axes.set_yticks(np.arange(0.5, len(over.restitutions) - 1.0), minor=True)
    axes.grid(which="minor", color="white", linewidth=0.8)
    axes.tick_params(which="both", length=0.0)
    axes.set(title=f"door {door!r}", xlabel="desired opening angle [deg]", ylabel="restitution e")


def _legend(
    places: dict[tuple[str, float, float], dict[str, Cell]], scale: ScalarMappable
) -> list[Patch]:
    """Entries of the legend: plans, hatch, and the limits that occur."""
    refused = {both["zmp_limited"].limit for both in places.values()
               if not any(cell.feasible for cell in both.values())}
    middle = scale.cmap(0.5)
    return [
        Patch(facecolor=middle, label="mcv50 and zmp_limited"),
        Patch(facecolor=middle, **_HATCH, label="zmp_limited only"),
        *(Patch(facecolor=_PALE[limit], label=f"neither: {words}")
          for limit, words in LIMITS.items() if limit in refused),
    ]
