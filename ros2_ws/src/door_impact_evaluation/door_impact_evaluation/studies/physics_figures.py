"""Draw the pictures of docs/physics.md."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")  # no display is assumed

import matplotlib.pyplot as plt
from door_impact_common.palette import BLUE, GREEN, VERMILION
from matplotlib.axes import Axes

MARKS = ("o-", "x--")  # line styles of the engines
_SIZE = (7.2, 3.6)  # width and height of a picture [inch]

_UNKNOWNS = (
    ("gear_scale", 1.0, "gears' stiffness [times the model's]"),
    ("pad_scale", 1.0, "pads' stiffness [times the model's]"),
    ("servo_scale", 1.0, "servos' gains [times the model's]"),
    ("rotor_scale", 1.0, "rotors' inertia [times the model's]"),
    ("restitution", 1.0, "restitution of the leaf"),
    ("contact_duration", 1e3, "duration of the contact [ms]"),
    ("leaf_friction", 1.0, "friction of the leaf"),
    ("friction", 1.0, "friction of the soles"),
    ("door_offset", 1e3, "door farther than surveyed [mm]"),
)


def draw(summary: Mapping[str, Any], out: Path) -> None:
    """Draw a picture of each part of the study that was run.

    Args:
        summary: Contents of summary.json, as `physics_study.study` returns them.
        out: Folder of the pictures.
    """
    sweeps = summary["sweeps"]
    if {"fine_step", "both_steps"} <= sweeps.keys():
        _time_steps(summary, out / "time_step.png")
    if {name for name, _, _ in _UNKNOWNS} <= sweeps.keys():
        _unknowns(summary, out / "unknowns.png")


def _pair(path: Path, fill: Any) -> None:
    figure, axes = plt.subplots(1, 2, figsize=_SIZE, layout="constrained")
    for part in axes:
        part.grid(alpha=0.3)
    fill(*axes)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _column(rows: Sequence[Mapping[str, Any]], key: str) -> list[float]:
    return [row.get(key, float("nan")) for row in rows]


def _time_steps(summary: Mapping[str, Any], path: Path) -> None:
    def fill(left: Axes, right: Axes) -> None:
        for name, label, color in (("fine_step", "near the leaf, 0.5 ms elsewhere", BLUE),
                                   ("both_steps", "everywhere", VERMILION)):
            for (engine, rows), mark in zip(summary["sweeps"][name].items(), MARKS, strict=False):
                step = [1e3 * value for value in _column(rows, "time_step_fine")]
                left.semilogx(step, _column(rows, "peak_deg"), mark, color=color,
                              label=f"{label}, {engine}")
                error = [1e2 * value for value in _column(rows, "speed_error_before_hit")]
                right.semilogx(step, error, mark, color=color)
        left.set(title="largest opening angle", xlabel="step [ms]", ylabel="angle [deg]")
        right.set(title="speed of B before the hit", xlabel="step [ms]",
                  ylabel="largest error of the speed [%]")
        left.legend(fontsize=7)

    _pair(path, fill)


def _unknowns(summary: Mapping[str, Any], path: Path) -> None:
    """Draw the largest opening angle over each setting, all on one scale of angles."""
    figure, grid = plt.subplots(3, 3, figsize=(9.0, 8.0), layout="constrained", sharey=True)
    for axes, (name, scale, label) in zip(grid.flat, _UNKNOWNS, strict=True):
        axes.axhline(summary["target_deg"], color=GREEN, ls=":", label="desired")
        for (engine, rows), mark, color in zip(
                summary["sweeps"][name].items(), MARKS, (BLUE, VERMILION), strict=False):
            axes.plot([scale * value for value in _column(rows, name)],
                      _column(rows, "peak_deg"), mark, color=color, label=engine)
        axes.set(xlabel=label)
        axes.grid(alpha=0.3)
    for axes in grid[:, 0]:
        axes.set(ylabel="largest opening angle [deg]")
    grid[0, 0].legend()
    figure.savefig(path, dpi=110)
    plt.close(figure)
