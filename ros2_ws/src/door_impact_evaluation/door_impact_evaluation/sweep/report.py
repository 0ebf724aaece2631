"""Make summary, table and figure of a sweep, whatever its kind."""

from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.palette import GREY, LINES, VERMILION

from door_impact_evaluation.sweep.kind import Kind, Panel, Row, count, known, smallest

WORST = 5  # worst runs that the table lists
COLUMNS = 3  # panels in a row of the figure
_SIZE = (3.4, 2.8)  # of a panel [inch]


def summary(kind: Kind, rows: list[Row], n: int, seed: int, engine: str) -> dict[str, Any]:
    """Make the contents of summary.json from the rows of all cases, n in each group."""
    columns = dict.fromkeys(name for row in rows for name in row)
    rows = [{name: row.get(name) for name in columns} for row in rows]
    return {
        "n": n, "seed": seed, "engine": engine,
        "stood": count(rows, "stood"), "refused": count(rows, "refused"),
        "errors": count(rows, "error"),
        "min_margin_mm": smallest(row.get("margin_mm") for row in rows),
        **kind.summary(rows),
        "groups": {label: {
            "n": len(group), **{name: count(group, name) for name in ("stood", *kind.counts)},
            **{name: statistic(row.get(name) for row in group if row.get("stood"))
               for name, statistic in kind.measures.items()},
        } for label, group in _groups(kind, rows).items()},
        "runs": rows,
    }


def _groups(kind: Kind, rows: list[Row]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(kind.label(row), []).append(row)
    return groups


def table(kind: Kind, found: dict[str, Any]) -> str:
    """Format the contents of summary.json as a table for a terminal."""
    runs, lines = found["runs"], [_cells(*each) for each in found["groups"].items()]
    widths = {name: max(len(name), *(len(line[name]) for line in lines)) for name in lines[0]}
    text = [f"{kind.name}: n {found['n']}, seed {found['seed']}, engine {found['engine']}; of "
            f"{len(runs)} runs {count(runs, 'stood')} stood, {found['refused']} were refused, "
            f"{found['errors']} failed (figures: of the runs that stood)"]
    text += ["  ".join(line[name].rjust(width) for name, width in widths.items())
             for line in ({name: name for name in widths}, *lines)]
    lost = [row for row in runs if not row.get("stood")]
    worst = sorted((row for row in runs if row.get("stood") and row.get(kind.worst) is not None),
                   key=lambda row: -abs(row[kind.worst]))[:WORST]
    return "\n".join([*text, "", *(_line(kind, row) for row in lost + worst)])


def _cells(label: str, group: dict[str, Any]) -> dict[str, str]:
    """Return the line of a group by the names of the table's columns."""
    cells = {"": label.ljust(20)}
    for name, value in group.items():
        parts = value if isinstance(value, dict) else {"": value}
        cells[f"{name} {'/'.join(parts)}"] = "/".join(
            "-" if each is None else f"{each:.3g}" for each in parts.values())
    return cells


def _line(kind: Kind, row: Row) -> str:
    """Say what is bad about a run, and what it was perturbed by."""
    why = next((f"{name}: {row[name]}" for name in ("error", "refused", "fell") if row.get(name)),
               f"{kind.worst} {row[kind.worst]:.3g}" if row.get("stood") else "did not stand")
    values = {panel.x: row.get(panel.x) for panel in kind.panels}
    return f"{row['group']}-{row['index']}, {kind.label(row)}: {why}; " + ", ".join(
        f"{name} {value:.3g}" for name, value in values.items() if value is not None)


def draw(kind: Kind, rows: list[Row], path: Path) -> None:
    """Draw the panels of a kind over the rows of all runs, with those that fell marked."""
    import matplotlib  # takes a second
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    groups, lines = _groups(kind, rows), -(-len(kind.panels) // COLUMNS)
    drawing, axes = plt.subplots(
        lines, COLUMNS, figsize=(_SIZE[0] * COLUMNS, _SIZE[1] * lines + 0.4), layout="constrained",
        squeeze=False)
    for axis, panel in zip(axes.flat, kind.panels, strict=False):
        for (label, group), color, marker in zip(groups.items(), LINES, "ox^+d", strict=False):
            if panel.y:
                axis.plot(*_points(panel, group), marker, color=color, markersize=4.5, label=label)
            else:
                axis.hist(known(row.get(panel.x) for row in group), 20, histtype="step",
                          color=color)
        if panel.y:
            fallen = [row for row in rows if row.get("stood") is False]
            axis.plot(*_points(panel, fallen), "s", color=VERMILION, markersize=8.5,
                      fillstyle="none", label="fell")
        for limit in panel.limits:
            axis.axhline(limit, color=GREY, linewidth=1.0, linestyle="--")
        axis.set(xlabel=panel.x, ylabel=panel.y or "runs")
    for unused in axes.flat[len(kind.panels):]:
        unused.set_axis_off()
    drawing.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside upper center",
                   ncols=len(groups) + 1, fontsize=9)
    drawing.savefig(path, dpi=110)
    plt.close(drawing)


def _points(panel: Panel, rows: list[Row]) -> Any:
    """Return x and y of runs, (2, n); what is not known, None, becomes NaN, which is not drawn."""
    return np.array([(row.get(panel.x), row.get(panel.y)) for row in rows],
                    dtype=float).reshape(-1, 2).T
