"""Command ``plan``: plans a walk without ROS nodes."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.documents import checked
from door_impact_common.files import draw_into, run_command
from door_impact_common.palette import BLUE, GREEN, GREY, PURPLE, VERMILION
from hrp2_description.robot import SIDES, load_robot_config, needed
from humanoid_motion.clearance import bodies_of
from humanoid_motion.robot_model import RobotModel

from walking.footsteps.footstep import Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import standing
from walking.pattern.walk_plan import WalkPlan

_SHOWN_JOINTS = 3  # number of the fastest joints in the text
# Colours that people with any kind of colour vision can tell apart (Okabe and Ito, 2008).
_COLOURS = {"left": GREEN, "right": PURPLE}
_SIZE = (11.0, 8.5)  # width and height of the figure [in]
_DPI = 90
_FONT: Any = {"font.size": 9.0, "axes.titlesize": 10.0, "legend.fontsize": 8.0}
_EXAMPLE = """\
examples:
  ros2 run walking plan --forward 2 --turn-deg 90 --plot walk.png
  ros2 run walking plan --left 0.6 --keep-heading
"""


def build_parser() -> argparse.ArgumentParser:
    """Make the parser of the command's arguments."""
    parser = argparse.ArgumentParser(
        prog="plan",
        description="Plan a walk from half-sitting at the origin, and print its footsteps and "
        "margins.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for name, what in (("forward", "way ahead, negative backwards"), ("left", "way to the left")):
        parser.add_argument(
            f"--{name}", type=float, default=0.0, metavar="M",
            help=f"{what} [m] (default: %(default)s)")
    parser.add_argument(
        "--turn-deg", type=float, default=0.0, metavar="DEG",
        help="turn of the robot, positive to the left; more than half a turn is made in full [deg] "
        "(default: %(default)s)")
    parser.add_argument(
        "--keep-heading", action="store_true",
        help="walk straight to the goal, sideways if need be, instead of facing the way")
    parser.add_argument(
        "--step-time", type=float, default=0.8, metavar="S",
        help="duration of a step [s] (default: %(default)s)")
    parser.add_argument(
        "--waist-height", type=float, metavar="M",
        help=f"height of base_link while walking [m] (default: {WalkSettings.waist_height:g} for "
        "HRP-2, for another robot by its height)")
    parser.add_argument(
        "--robot", metavar="YAML", help="robot.yaml of another robot (default: HRP-2)")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw the walk (PNG, PDF, SVG)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def main(args: list[str] | None = None) -> int:
    """Run the command.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        Exit status: 0, or 1 after a failure, whose reason is printed on stderr.
    """
    options = build_parser().parse_args(args)
    return run_command("plan", lambda: _answer(options))


def _answer(options: argparse.Namespace) -> str:
    robot = RobotModel(load_robot_config(options.robot))
    bodies_of(robot)  # reads the shapes, which takes longer than planning
    begin = perf_counter()
    plan = _planned(robot, options)
    planning_time = perf_counter() - begin
    if options.plot is not None:
        draw_into(options.plot, lambda: draw_walk(plan, robot, options.plot))
    if options.json:
        return json.dumps(plan_object(plan, robot, planning_time), allow_nan=False)
    return plan_text(plan, robot, planning_time)


def _planned(robot: RobotModel, options: argparse.Namespace) -> WalkPlan:
    width = needed(robot.config.footsteps, "footsteps").width
    stance = Stance.around(Pose(0.0, 0.0, 0.0), width)
    goal = Pose(options.forward, options.left, math.radians(options.turn_deg))
    footsteps = plan_footsteps(
        robot.config, stance, goal, options.step_time, keep_heading=options.keep_heading,
        whole_turns=True)
    settings = WalkSettings.of(robot)
    if options.waist_height is not None:
        settings = checked(WalkSettings, vars(settings) | {"waist_height": options.waist_height})
    return plan_walk(robot, standing(robot, stance), footsteps, settings)


def plan_object(plan: WalkPlan, robot: RobotModel, planning_time: float) -> dict[str, Any]:
    """Return a walk as a JSON object.

    Args:
        planning_time: Time that planning took [s].
    """
    checks, goal = plan.checks, plan.stance.middle
    clearance = checks.clearance
    return {
        "planning_ms": 1e3 * planning_time,
        "duration": plan.duration,
        "goal": {"x": goal.x, "y": goal.y, "yaw_deg": math.degrees(goal.yaw)},
        "min_margin_mm": 1e3 * float(checks.margin.min()),
        "required_friction": float(checks.friction.max()),
        "speed_ratio": _by_joint(robot, checks.speed_ratio),
        "torque_ratio": _by_joint(robot, checks.torque_ratio),
        "clearance": None if clearance is None or not clearance.bodies else {
            "bodies": list(clearance.bodies), "distance_mm": 1e3 * clearance.distance,
            "limit_mm": 1e3 * clearance.limit},
        "footsteps": [
            {"side": step.side, "x": step.x, "y": step.y, "yaw_deg": math.degrees(step.yaw),
             "begin": plan.begin_of(index), "touchdown": plan.touchdown_of(index),
             "min_margin_mm": 1e3 * _margin(plan, index)}
            for index, step in enumerate(plan.footsteps)],
    }


def plan_text(plan: WalkPlan, robot: RobotModel, planning_time: float) -> str:
    """Return a walk as tables for people; the arguments are those of `plan_object`."""
    found = plan_object(plan, robot, planning_time)
    goal, clearance = found["goal"], found["clearance"]
    rows = [
        ("goal", f"x {goal['x']:.3f} m, y {goal['y']:.3f} m, yaw {goal['yaw_deg']:.1f} deg"),
        ("footsteps", f"{len(plan.footsteps)}"),
        ("duration", f"{plan.duration:.2f} s"),
        ("smallest ZMP margin", f"{found['min_margin_mm']:.1f} mm"),
        ("friction needed", f"{found['required_friction']:.2f}"),
        ("fastest joints", _largest(found["speed_ratio"])),
        ("largest torques", _largest(found["torque_ratio"])),
    ]
    if clearance is not None:
        rows.append(("smallest clearance", f"{clearance['distance_mm']:.0f} mm between "
                     f"{' and '.join(clearance['bodies'])} ({clearance['limit_mm']:.0f} mm "
                     "required)"))
    rows.append(("planned in", f"{found['planning_ms']:.0f} ms"))
    lines = [f"{name:<22}{value}" for name, value in rows]
    if plan.footsteps:
        lines += ["", f"{'step':>4}  {'foot':<6}{'x [m]':>8}{'y [m]':>8}{'yaw [deg]':>11}"
                  f"{'begins [s]':>12}{'lands [s]':>11}{'margin [mm]':>13}"]
    for number, step in enumerate(found["footsteps"], start=1):
        lines.append(
            f"{number:>4}  {step['side']:<6}{step['x']:>8.3f}{step['y']:>8.3f}"
            f"{step['yaw_deg']:>11.1f}{step['begin']:>12.2f}{step['touchdown']:>11.2f}"
            f"{step['min_margin_mm']:>13.1f}")
    return "\n".join(lines)


def _by_joint(robot: RobotModel, values: Any) -> dict[str, float]:
    return dict(zip(robot.joint_names, np.asarray(values).tolist(), strict=True))


def _largest(shares: dict[str, float]) -> str:
    names = sorted(shares, key=lambda name: -shares[name])[:_SHOWN_JOINTS]
    return ", ".join(f"{name} {100.0 * shares[name]:.0f} %" for name in names) + " of their limits"


def _margin(plan: WalkPlan, step: int) -> float:
    """Smallest ZMP margin from a step's beginning to its touchdown [m]."""
    first, last = (round(time / plan.schedule.period)
                   for time in (plan.begin_of(step), plan.touchdown_of(step)))
    return float(plan.checks.margin[first : last + 1].min())


def draw_walk(plan: WalkPlan, robot: RobotModel, path: Path) -> None:
    """Write a figure of a walk; the file's suffix decides the format.

    Args:
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
