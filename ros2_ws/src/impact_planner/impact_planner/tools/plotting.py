"""Figure of a plan: the paper's Fig. 5, and run-up, ZMP and door over time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.palette import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION
from door_impact_common.span_labels import label_spans
from hrp2_description.robot import SIDES
from hrp2_description.support import support_polygon
from humanoid_motion.robot_model import RobotModel
from matplotlib import rc_context
from matplotlib.figure import Figure

from impact_planner.hit.stance import initial_feet
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.catch import LATE
from impact_planner.motion.phase_plan import PhasePlan
from impact_planner.tools.plan_views import draw_above, draw_front


def draw_plan(plan: ImpactPlan, robot: RobotModel, path: Path) -> None:
    """Write a figure of a plan; the file's suffix decides the format.

    Args:
        plan: The plan.
        robot: Robot that the plan is for.
        path: File to write.

    Raises:
        OSError: The file cannot be written.
        ValueError: The suffix names no known format.
    """
    with rc_context({"font.size": 9.0, "axes.titlesize": 10.0, "legend.fontsize": 8.0}):
        figure: Any = Figure(figsize=(11.0, 8.2), layout="constrained")
        figure.suptitle(_title(plan))
        views, courses = figure.subfigures(2, 1, height_ratios=(5.2, 3.0))
        front, above = views.subplots(1, 2, width_ratios=(1.0, 1.12))
        draw_front(front, plan, robot)
        draw_above(above, plan, robot)
        front.set_title("(a) at the hit, from the front (Fig. 5 (a))")
        above.set_title("(b) from above; the robot looks down the page (Fig. 5 (b))")
        run_up, zmp, door = courses.subplots(1, 3, width_ratios=(1.0, 1.4, 1.0))
        _draw_run_up(run_up, plan)
        _draw_zmp(zmp, plan, robot)
        _draw_door(door, plan)
        figure.savefig(path, dpi=90)  # as wide as a page of the documentation


def door_course(plan: ImpactPlan) -> tuple[Array, Array, float]:
    """Return times after the hit (N,) [s], opening angles (N,) [rad], start of the last phase [s].

    The last phase starts when the peak is detected, which is `catch.LATE` after it.
    """
    post, last = plan.phase("post"), plan.phases[-1]
    assert post.leaf is not None
    assert last.leaf is not None
    start = plan.peak_time + LATE
    free = post.time + (plan.switch_time - plan.contact_time)
    time = np.concatenate([[0.0], free[free > 0.0], start + last.time])
    angle = np.concatenate([[plan.initial_angle], post.leaf.angle[free > 0.0], last.leaf.angle])
    return time, angle, start


def _title(plan: ImpactPlan) -> str:
    """Return a title with the request and the figures of the hit."""
    peak = math.degrees(plan.desired_opening_angle)
    return (
        f"Door {plan.door!r} to {peak:.1f}°, {plan.run_up}, {plan.ending}:  "
        rf"$\omega'$ = {plan.omega_door:.3f} rad/s,  $m_{{re}}$ = {plan.effective_mass:.1f} kg,  "
        rf"$v_{{rB}}$ = {plan.v_rb:.3f} m/s,  $v'_{{rB}}$ = {plan.v_rb_post:.3f} m/s,  "
        rf"$e$ = {plan.apparent_restitution:.2f}")


def _draw_run_up(axis: Any, plan: ImpactPlan) -> None:
    """Draw distance, speed and acceleration of the CoM in the run-up; MCV50 is Fig. 6."""
    cam = plan.phase("cam")
    way = cam.com_samples[0, 1] - cam.com_samples[:, 1]
    speed = np.gradient(way, cam.time)
    hit = np.interp(plan.contact_time, cam.time, way)
    half = 0.5 * plan.steady_way
    axis.axvspan(*np.interp([hit - half, hit + half], way, cam.time), color=PURPLE, alpha=0.25,
                 linewidth=0.0, label="steady stretch")
    axis.plot(cam.time, way, color=BLUE, label="distance of the CoM [m]")
    axis.plot(cam.time, speed, color=GREEN, label="speed [m/s]")
    axis.plot(cam.time, np.gradient(speed, cam.time) / 10.0, color=ORANGE,
              label="acceleration / 10 [m/s²]")
    axis.axvline(plan.contact_time, color=PURPLE, linestyle="--", label="nominal contact")
    axis.axvline(plan.contact_time - plan.point_of_no_return, color="k", linestyle=":",
                 label="point of no return")
    course = "MCV50 (Fig. 6)" if plan.run_up == "mcv50" else "largest ZMP margin"
    axis.set(title=f"(c) run-up: {course}", xlabel="time in the phase cam [s]",
             xlim=(0.0, cam.time[-1]))
    _legend_below(axis, 2)


def _draw_zmp(axis: Any, plan: ImpactPlan, robot: RobotModel) -> None:
    """Draw CoM and ZMP towards the door over the whole motion, Fig. 8."""
    offset, spans = 0.0, []
    for number, phase in enumerate(plan.phases):
        # The run-up continues past the switch to `post` as a reserve, which is not shown.
        end = plan.switch_time if phase.name == "cam" else float(phase.time[-1])
        shown = phase.time <= end
        time = offset + phase.time[shown]
        low, high = _support_range(phase, plan, robot)
        axis.fill_between([offset, offset + end], -high, -low, color=GREY, alpha=0.3, linewidth=0.0,
                          label=None if number else "support polygon")
        axis.plot(time, -phase.com_samples[shown, 1], color=BLUE, label=None if number else "CoM")
        axis.plot(time, -phase.zmp_samples[shown, 1], color=VERMILION,
                  label=None if number else "ZMP")
        spans.append((phase.name, offset, offset + end))
        if phase.name == "cam":
            axis.axvline(offset + plan.contact_time, color=PURPLE, linestyle="--",
                         label="nominal contact")
        offset += end
    axis.set(xlabel="time [s]", ylabel="-y [m], towards the door", xlim=(0.0, offset))
    _legend_below(axis, 2)
    axis.set_title("(d) ZMP (Fig. 8)", pad=label_spans(axis, spans))


def _support_range(phase: PhasePlan, plan: ImpactPlan, robot: RobotModel) -> tuple[float, float]:
    """Return the lower and upper y of the support polygon in a phase [m]."""
    feet = {"left": plan.left_foot, "right": plan.right_foot}
    if phase.name in ("prepare", "shift"):
        feet = initial_feet(robot)
    sides = ("left",) if phase.name == "step" else SIDES
    corners = support_polygon(*(robot.feet[side].corners(feet[side]) for side in sides))
    return float(corners[:, 1].min()), float(corners[:, 1].max())


def _draw_door(axis: Any, plan: ImpactPlan) -> None:
    """Draw the predicted opening angle after the hit, Fig. 9."""
    time, angle, start = door_course(plan)
    desired = math.degrees(plan.desired_opening_angle)
    axis.axhline(desired, color=PURPLE, linestyle=":", label=f"desired, {desired:.1f}°")
    axis.plot(time, np.degrees(angle), color=BLUE, label="predicted")
    axis.axvline(start, color="0.6", linewidth=0.8)
    axis.set(xlabel="time after the hit [s]", ylabel="opening angle [°]", xlim=(0.0, time[-1]),
             ylim=(0.0, 1.15 * desired))
    _legend_below(axis, 2)
    spans = [("post", 0.0, start), (plan.phases[-1].name, start, float(time[-1]))]
    axis.set_title("(e) door (Fig. 9)", pad=label_spans(axis, spans))


def _legend_below(axis: Any, columns: int) -> None:
    """Draw a grid, and a legend below the label of the x axis, where it hides nothing."""
    axis.grid(alpha=0.3)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.27), ncols=columns, frameon=False,
                columnspacing=1.0, handlelength=1.4)
