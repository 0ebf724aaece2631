"""Figure of a plan: the paper's Fig. 5, and run-up, ZMP and door over time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.palette import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION
from door_impact_common.span_labels import label_spans
from hrp2_description.robot import SIDES
from hrp2_description.support import support_polygon
from humanoid_motion.robot_model import RobotModel

from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.catch import LATE
from impact_planner.motion.phase_plan import PhasePlan
from impact_planner.task.settings import PlannerSettings
from impact_planner.tools.plan_scene import PlanScene, caught_after, door_course, plan_scene
from impact_planner.tools.plan_views import draw_floor, draw_front, draw_top, legend_below

_HEIGHTS = (5.2, 2.9, 2.9, 2.4)  # heights of the rows [in]
_WIDTH = 11.0  # width of the figure [in]
_DPI = 90  # resolution, with which a PNG is as wide as a page of the documentation [1/in]
_FONT: Any = {"font.size": 9.0, "axes.titlesize": 10.0, "legend.fontsize": 8.0}


def draw_plan(plan: ImpactPlan, robot: RobotModel, settings: PlannerSettings, path: Path) -> None:
    """Write a figure of a plan; the file's suffix decides the format.

    Args:
        plan: The plan.
        robot: Robot that the plan is for.
        settings: Configuration with the limits to draw.
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
    scene = plan_scene(plan, robot)
    with rc_context(_FONT):
        figure: Any = Figure(figsize=(_WIDTH, sum(_HEIGHTS)), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(_title(plan))
        rows = figure.subfigures(len(_HEIGHTS), 1, height_ratios=_HEIGHTS)
        front, top = rows[0].subplots(1, 2)
        draw_front(front, plan, robot, scene)
        draw_top(top, plan, robot, scene)
        shapes = [1.0 / axis.get_data_ratio() for axis in (front, top)]
        front.get_gridspec().set_width_ratios(shapes)  # gives both views the same height
        floor, run_up = rows[1].subplots(1, 2)
        draw_floor(floor, plan, robot, scene)
        _draw_run_up(run_up, plan, scene)
        zmp, door = rows[2].subplots(1, 2)
        _draw_zmp(zmp, plan, robot, scene)
        _draw_door(door, plan, robot)
        margins, shares = rows[3].subplots(1, 2)
        _draw_margins(margins, plan, settings)
        _draw_shares(shares, plan, settings)
        figure.savefig(path, dpi=_DPI)


def _title(plan: ImpactPlan) -> str:
    """Title with the request and the figures of the hit."""
    peak = math.degrees(plan.desired_opening_angle)
    return (
        f"Door {plan.door!r} to {peak:.1f}°, {plan.run_up}, {plan.ending}:  "
        rf"$\omega'$ = {plan.omega_door:.3f} rad/s,  $m_{{re}}$ = {plan.effective_mass:.1f} kg,  "
        rf"$v_{{rB}}$ = {plan.v_rb:.3f} m/s,  $v'_{{rB}}$ = {plan.v_rb_post:.3f} m/s,  "
        rf"$e$ = {plan.apparent_restitution:.2f}")


def _draw_run_up(axis: Any, plan: ImpactPlan, scene: PlanScene) -> None:
    """Draw distance, speed and acceleration of the CoM in the run-up; MCV50 is Fig. 6."""
    cam = plan.phase("cam")
    y = cam.com_samples[:, 1]
    speed = -np.gradient(y, cam.time)
    ends = [float(np.interp(-end, -y, cam.time)) for end in scene.steady[:, 1]]
    axis.axvspan(*ends, color=PURPLE, alpha=0.25, linewidth=0.0, label="steady stretch")
    axis.plot(cam.time, -(y - y[0]), color=BLUE, label="distance of the CoM [m]")
    axis.plot(cam.time, speed, color=GREEN, label="speed [m/s]")
    axis.plot(cam.time, np.gradient(speed, cam.time) / 10.0, color=ORANGE,
              label="acceleration / 10 [m/s²]")
    axis.axvline(plan.contact_time, color=PURPLE, linestyle="--", label="nominal contact")
    axis.axvline(plan.contact_time - plan.point_of_no_return, color="k", linestyle=":",
                 label="point of no return")
    course = "first half of MCV50 (Fig. 6)" if plan.run_up == "mcv50" else "largest ZMP margin"
    axis.set(title=f"(d) run-up: {course}, constant speed, stop if missed",
             xlabel="time in the phase cam [s]")
    axis.set_xlim(0.0, cam.time[-1])
    axis.grid(alpha=0.3)
    legend_below(axis, 3)


def _draw_zmp(axis: Any, plan: ImpactPlan, robot: RobotModel, scene: PlanScene) -> None:
    """Draw CoM and ZMP towards the door over the whole motion, Fig. 8."""
    offset, spans = 0.0, []
    for number, phase in enumerate(plan.phases):
        # The run-up continues past the switch to `post` as a reserve, which is not shown.
        shown = phase.time <= (plan.switch_time if phase.name == "cam" else np.inf)
        time = offset + phase.time[shown]
        end = plan.switch_time if phase.name == "cam" else float(phase.time[-1])
        low, high = _support_range(phase, robot, scene)
        axis.fill_between([offset, offset + end], -high, -low, color=GREY, alpha=0.3, linewidth=0.0,
                          label=None if number else "support polygon")
        axis.plot(time, -phase.com_samples[shown, 1], color=BLUE, label=None if number else "CoM")
        axis.plot(time, -phase.zmp_samples[shown, 1], color=VERMILION,
                  label=None if number else "ZMP")
        axis.axvline(offset, color="0.8", linewidth=0.8)
        spans.append((phase.name, offset, offset + end))
        offset += end
        if phase.name == "cam":
            axis.axvline(offset, color=PURPLE, linestyle="--", label="nominal contact")
    axis.set(xlabel="time [s]", ylabel="-y [m], towards the door", xlim=(0.0, offset))
    axis.grid(alpha=0.3)
    legend_below(axis, 4)
    axis.set_title("(e) ZMP (Fig. 8)", pad=label_spans(axis, spans))


def _support_range(phase: PhasePlan, robot: RobotModel, scene: PlanScene) -> tuple[float, float]:
    """Lower and upper y of the support polygon in a phase [m]."""
    feet = scene.feet_start if phase.name in ("prepare", "shift") else scene.feet
    sides = ("left",) if phase.name == "step" else SIDES
    corners = support_polygon(*(robot.feet[side].corners(feet[side]) for side in sides))
    return float(corners[:, 1].min()), float(corners[:, 1].max())


def _draw_door(axis: Any, plan: ImpactPlan, robot: RobotModel) -> None:
    """Draw the predicted opening angle after the hit, Fig. 9."""
    time, angle, start = door_course(plan)
    degrees = np.degrees(angle)
    desired = math.degrees(plan.desired_opening_angle)
    axis.axhline(desired, color=PURPLE, linestyle=":", label=f"desired, {desired:.1f}°")
    axis.plot(time, degrees, color=BLUE, label="eq. (1)")
    ends = [0.0, plan.peak_time, start, float(time[-1])]
    names = ["post", "", plan.phases[-1].name]
    if plan.ending == "hold":
        caught = start + caught_after(plan, robot)
        axis.plot(caught, np.interp(caught, time, degrees), "o", color=GREEN,
                  label="caught")
        axis.plot(time[time >= caught], degrees[time >= caught], color=GREEN,
                  label="led by the hand")
    for high in ends[1:]:
        axis.axvline(high, color="0.8", linewidth=0.8)
    axis.set(xlabel=f"time after the hit [s]; {names[-1]}: peak detected {LATE:.2f} s late",
             ylabel="opening angle [°]", xlim=(0.0, time[-1]), ylim=(0.0, 1.15 * desired))
    axis.grid(alpha=0.3)
    legend_below(axis, 4)
    spans = list(zip(names, ends, ends[1:], strict=False))
    axis.set_title("(f) door (Fig. 9)", pad=label_spans(axis, spans))


def _draw_margins(axis: Any, plan: ImpactPlan, settings: PlannerSettings) -> None:
    """Draw the smallest ZMP margins of each phase, and of doors that stand elsewhere."""
    off = f"{500.0 * plan.steady_way:.0f} mm"
    margins = {
        **plan.zmp_margins, f"{off}\nnearer": plan.branches.early_margin,
        f"{off}\nfarther": plan.branches.late_margin}
    colors = [BLUE] * len(plan.phases) + [GREY] * 2
    bars = axis.bar(list(margins), [1e3 * each for each in margins.values()], color=colors)
    axis.bar_label(bars, fmt="%.0f", fontsize=8)
    axis.axhline(1e3 * settings.required_margin, color=PURPLE, linestyle="--",
                 label=f"required: {1e3 * settings.required_margin:.0f} mm")
    axis.set(title="(g) smallest ZMP margin; grey: post, the door elsewhere", ylabel="[mm]")
    axis.margins(y=0.3)
    axis.legend(loc="upper right", frameon=False)


def _draw_shares(axis: Any, plan: ImpactPlan, settings: PlannerSettings) -> None:
    """Draw the shares of the joints' speed and torque limits that each phase uses."""
    place = np.arange(len(plan.phases))
    for shift, color, name, attribute in (
        (-0.2, GREEN, "speed", "speed_ratio"), (0.2, ORANGE, "torque", "torque_ratio")
    ):
        values = [100.0 * getattr(phase, attribute) for phase in plan.phases]
        bars = axis.bar(place + shift, values, 0.4, color=color, label=name)
        axis.bar_label(bars, fmt="%.0f", fontsize=8, padding=1.0, zorder=4, bbox={
            "facecolor": "white", "edgecolor": "none", "pad": 0.5})
    axis.axhline(100.0 * settings.limit_share, color=PURPLE, linestyle="--",
                 label=f"allowed: {100.0 * settings.limit_share:.0f} %")
    axis.set_xticks(place, [phase.name for phase in plan.phases])
    axis.set(title="(h) largest joint speed and torque", ylabel="[% of the limit]",
             ylim=(0.0, 125.0))
    axis.legend(loc="upper left", ncols=3, frameon=False)
