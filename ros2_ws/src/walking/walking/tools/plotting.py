"""Figure of a walk: footsteps, CoM and ZMP in the plane, and the ZMP over time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.palette import BLUE, GREEN, GREY, PURPLE, VERMILION
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel

from walking.pattern.walk_plan import WalkPlan

# Colours that people with any kind of colour vision can tell apart (Okabe and Ito, 2008).
_COLOURS = {"left": GREEN, "right": PURPLE}
_SIZE = (11.0, 8.5)  # width and height of the figure [in]
_DPI = 90
_FONT: Any = {"font.size": 9.0, "axes.titlesize": 10.0, "legend.fontsize": 8.0}


def draw_walk(plan: WalkPlan, robot: RobotModel, path: Path) -> None:
    """Write a figure of a walk; the file's suffix decides the format.

    Args:
        plan: The walk.
        robot: Robot that the walk is for.
        path: File to write.

    Raises:
        ImportError: matplotlib is not installed.
        OSError: The file cannot be written.
        ValueError: The suffix names no known format.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("matplotlib is missing: pip install matplotlib") from error
    with rc_context(_FONT):
        figure: Any = Figure(figsize=_SIZE, layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(
            f"{len(plan.footsteps)} footsteps, {plan.duration:.1f} s, smallest ZMP margin "
            f"{1e3 * plan.checks.margin.min():.0f} mm")
        axes = figure.subplot_mosaic([["floor", "floor"], ["x", "y"]], height_ratios=[1.3, 1.0])
        _draw_floor(axes["floor"], plan, robot)
        for axis, column, name in ((axes["x"], 0, "x"), (axes["y"], 1, "y")):
            _draw_course(axis, plan, robot, column, name)
        figure.savefig(path, dpi=_DPI)


def _draw_floor(axis: Any, plan: WalkPlan, robot: RobotModel) -> None:
    stance = plan.schedule.phases[0].stance
    for side in SIDES:
        pose = stance.foot(side)
        corners = robot.feet[side].corners(np.array([pose.x, pose.y, 0.0]), pose.yaw)
        axis.fill(*corners.T, facecolor="none", edgecolor=_COLOURS[side], linestyle="--")
    for number, step in enumerate(plan.footsteps, start=1):
        corners = robot.feet[step.side].corners(np.array([step.x, step.y, 0.0]), step.yaw)
        axis.fill(*corners.T, facecolor=_COLOURS[step.side] + "30", edgecolor=_COLOURS[step.side])
        middle = corners.mean(axis=0)
        axis.text(*middle, str(number), ha="center", va="center", color=_COLOURS[step.side],
                  rotation=math.degrees(step.yaw))
    axis.plot(*plan.zmp.T, color=VERMILION, linewidth=0.9, label="ZMP")
    axis.plot(*plan.com[:, :2].T, color=BLUE, linewidth=1.6, label="CoM")
    axis.set(xlabel="x [m]", ylabel="y [m]", aspect="equal",
             title="soles (dashed: at the start), CoM and ZMP")
    axis.set_adjustable("datalim")
    axis.legend(loc="upper right")


def _draw_course(axis: Any, plan: WalkPlan, robot: RobotModel, column: int, name: str) -> None:
    low, high = _edges(plan, robot, column)
    time = plan.motion.time
    axis.fill_between(time, low, high, color=GREY, alpha=0.25, linewidth=0.0,
                      label="between the edges of the soles that stand")
    axis.plot(time, plan.zmp_reference[:, column], color=GREY, linestyle=":", label="reference")
    axis.plot(time, plan.zmp[:, column], color=VERMILION, linewidth=0.9, label="ZMP")
    axis.plot(time, plan.com[:, column], color=BLUE, linewidth=1.6, label="CoM")
    axis.set(xlabel="time [s]", ylabel=f"{name} [m]", title=f"{name} of ZMP and CoM")
    axis.margins(x=0.0)
    if column == 0:
        axis.legend(loc="lower right")


def _edges(plan: WalkPlan, robot: RobotModel, column: int) -> tuple[Array, Array]:
    """Smallest and largest coordinate of the standing soles' corners, (N,) each [m]."""
    low, high = np.empty(len(plan.motion)), np.empty(len(plan.motion))
    for phase in plan.schedule.phases:
        poses = {side: phase.stance.foot(side) for side in phase.sides}
        corners = np.vstack([
            robot.feet[side].corners(np.array([pose.x, pose.y, 0.0]), pose.yaw)
            for side, pose in poses.items()])
        rows = slice(phase.first, phase.last + 1)
        low[rows], high[rows] = corners[:, column].min(), corners[:, column].max()
    return low, high
