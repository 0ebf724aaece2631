"""Figure of a plan: the paper's Fig. 5, and run-up, ZMP and door over time."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.palette import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION
from door_impact_common.span_labels import label_spans
from hrp2_description.robot import SIDES
from hrp2_description.support import support_polygon
from humanoid_motion.clearance import bodies_of
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.robot_model import RobotModel
from matplotlib import rc_context
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from impact_planner.hit.stance import initial_feet
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.catch import LATE
from impact_planner.motion.phase_plan import PhasePlan

_TOP = 1.55  # height at which the leaf is cut off in the view from the front [m]
_BODY, _ARM, _LEAF, _SOLE, _BROWN = "#e8eaee", "#c3d5ea", "#e2c9a6", "#9aa3af", "#7a4a1e"
_HALO = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}
_AROUND, _RINGS = 48, 13  # points of a circle; circles from pole to pole of a sphere


def configuration_at_hit(plan: ImpactPlan, robot: RobotModel) -> Array:
    """Return the configuration of the robot in odom at the nominal contact.

    It stands on its left sole, which does not move in any phase.
    """
    joints, _, _ = plan.phase("cam").knots.at(plan.contact_time)
    sole = robot.frame_position(
        robot.configuration(np.zeros(3), joints), robot.feet["left"].frame)
    return robot.configuration(plan.left_foot - sole, joints)


def body_outlines(robot: RobotModel, q: Array, axes: tuple[int, int]) -> list[tuple[int, Array]]:
    """Return the outlines of the robot's collision shapes, the farthest first.

    Args:
        q: Configuration of the robot in odom.
        axes: Two of odom's axes, such as (1, 2) for y and z. The eye is far along the third.

    Returns:
        For each shape Pinocchio's index of the joint that moves it, and the corners of its convex
        outline, (V, 2) [m].
    """
    geometry, depth = bodies_of(robot).shapes, 3 - sum(axes)
    data = geometry.createData()
    pin.updateGeometryPlacements(robot.model, robot.data, geometry, data, q)
    found = []
    for item, pose in zip(geometry.geometryObjects, data.oMg, strict=True):
        points = _surface_points(item.geometry) @ pose.rotation.T + pose.translation
        flat = points[:, axes]
        corners = flat[ConvexHull(flat).vertices]
        found.append((float(points[:, depth].mean()), int(item.parentJoint), corners))
    return [(joint, corners) for _, joint, corners in sorted(found, key=lambda each: each[0])]


def _surface_points(shape: Any) -> Array:
    """Return points whose convex hull is a shape, in the shape's frame, (V, 3) [m].

    A round shape exceeds the hull of its points by less than 1 % of its radius.
    """
    if hasattr(shape, "points"):  # the hull of a mesh
        return np.asarray(shape.points(), dtype=float).reshape(-1, 3)
    turn = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    if hasattr(shape, "halfLength"):  # a cylinder, along z
        ends = np.repeat([-shape.halfLength, shape.halfLength], _AROUND)
        return np.column_stack([np.tile(shape.radius * ring, (2, 1)), ends])
    if hasattr(shape, "radius"):  # a sphere
        rise = np.repeat(np.linspace(-0.5 * np.pi, 0.5 * np.pi, _RINGS), _AROUND)
        level = np.cos(rise)[:, None] * np.tile(ring, (_RINGS, 1))
        return shape.radius * np.column_stack([level, np.sin(rise)])
    half = np.array(shape.halfSide)  # a box
    return half * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def draw_front(axis: Any, plan: ImpactPlan, robot: RobotModel) -> None:
    """Draw the robot at the hit in the plane of y and z, Fig. 5 (a)."""
    q, leaf = configuration_at_hit(plan, robot), plan.phase("post").leaf
    g, b = robot.com(q), plan.contact_point
    back, right = b[1] - leaf.thickness, 0.40
    _polygon(axis, [(back, 0.0), (b[1], 0.0), (b[1], _TOP), (back, _TOP)], _LEAF, _BROWN)
    _draw_bodies(axis, robot, q, (1, 2))
    for side, foot in (("left", plan.left_foot), ("right", plan.right_foot)):
        across = foot[1] + np.array(robot.feet[side].rectangle[2:])
        axis.plot(across, [0.0, 0.0], color="k", linewidth=5.0, solid_capstyle="butt", zorder=4)
    axis.axhline(0.0, color="k", linewidth=1.0)
    axis.plot([g[1], g[1]], [0.0, g[2]], color=BLUE, linewidth=1.0, linestyle="--", zorder=5)
    _point(axis, (g[1], g[2]), "G", "center of mass", BLUE, (62, 24))
    _point(axis, (b[1], b[2]), "B", "elbow", PURPLE, (-40, 14))
    _point(axis, (g[1], 0.0), "C", "center of percussion", "k", (-58, -24))
    for y, z in ((g[1], g[2]), (b[1], b[2])):
        axis.plot([y, right], [z, z], color="k", linewidth=0.6, linestyle=(0, (4, 3)), zorder=0.2)
    for low, high, name in ((0.0, g[2], "$b_r$"), (g[2], b[2], "$a_r$")):
        _arrow(axis, (right, low), (right, high), "<->")
        axis.text(right + 0.03, 0.5 * (low + high), name, va="center")
    _arrow(axis, (b[1] + 0.33, 1.30), (b[1] + 0.10, 1.30))
    axis.text(b[1] + 0.215, 1.33, "$v_{rB}$", ha="center", va="bottom")
    axis.text(back - 0.02, 0.30, "leaf", color=_BROWN, ha="right")
    axis.set(title="from the front", xlabel="y [m]", ylabel="z [m]", aspect="equal",
             xlim=(back - 0.34, 0.55), ylim=(-0.2, _TOP))


def draw_above(axis: Any, plan: ImpactPlan, robot: RobotModel) -> None:
    """Draw robot and door at the hit, and the opened door, in the plane of y and -x, Fig. 5 (b)."""
    q, leaf = configuration_at_hit(plan, robot), plan.phase("post").leaf
    shut, opened = plan.initial_angle, plan.desired_opening_angle
    sizes = ((0.0, 0.0), (leaf.width, 0.0), (leaf.width, -leaf.thickness), (0.0, -leaf.thickness))
    leaves = [_turned([LeafFrame(leaf.hinge, angle).point(way, 0.0, gap) for way, gap in sizes])
              for angle in (shut, opened)]
    for corners, line, shade in zip(leaves, ("-", "--"), (1.0, 0.5), strict=True):
        _polygon(axis, corners, _LEAF, _BROWN, linestyle=line, alpha=shade)
    _draw_bodies(axis, robot, q, (1, 0), alpha=0.5)
    for side, foot in (("left", plan.left_foot), ("right", plan.right_foot)):
        _polygon(axis, _turned(robot.feet[side].corners(foot)), _SOLE, "k", alpha=0.55)
    sweep = LeafFrame(leaf.hinge, np.linspace(shut, opened, 40))
    for radius in (plan.l_b, leaf.width):
        axis.plot(*_turned(sweep.point(radius, 0.0, 0.0)).T, color=_BROWN, lw=0.9, linestyle=":")
    arc = _turned(sweep.point(0.66 * leaf.width, 0.0, 0.0))
    axis.plot(*arc.T, color=_BROWN, linewidth=1.4)
    _arrow(axis, arc[-4], arc[-1], color=_BROWN)
    axis.text(arc[20, 0], arc[20, 1] - 0.03, rf"$\theta$ = {math.degrees(opened):.3g}°",
              color=_BROWN, ha="center", va="top")
    a, b, g = _turned([leaf.hinge, plan.contact_point[:2], robot.com(q)[:2]])
    _point(axis, a, "A", "hinge", _BROWN, (40, 6))
    _point(axis, b, "B", "", PURPLE, (13, -10))
    _point(axis, g, "G, C", "", BLUE, (-10, 9))
    beside = a[0] + 0.14
    _arrow(axis, (beside, a[1]), (beside, b[1]), "<->")
    for place in (a, b):
        axis.plot([place[0], beside], [place[1]] * 2, color="k", linewidth=0.6)
    axis.text(beside + 0.02, 0.6 * a[1] + 0.4 * b[1], "$l_B$", va="center", bbox=_HALO)
    low, high = np.vstack(leaves).min(axis=0), np.vstack(leaves).max(axis=0)
    axis.set(title="from above; the robot looks down the page", xlabel="y [m]", ylabel="-x [m]",
             aspect="equal", xlim=(low[0] - 0.06, 0.30), ylim=(low[1] - 0.06, high[1] + 0.08))


def _turned(places: Any) -> Array:
    """Return places of x and y, (N, 2) or more, as y and -x, (N, 2) [m]."""
    places = np.asarray(places)
    return np.column_stack([places[:, 1], -places[:, 0]])


def _draw_bodies(
    axis: Any, robot: RobotModel, q: Array, axes: tuple[int, int], alpha: float = 1.0
) -> None:
    """Draw the robot's bodies; the arm that hits has a colour of its own."""
    arm = set(robot.model.subtrees[robot.model.getJointId(robot.config.arm.joints[0])])
    down = (1.0, -1.0 if axes[1] == 0 else 1.0)
    axis.grid(color="#8a9099", alpha=0.2)
    axis.set_axisbelow(True)
    for joint, corners in body_outlines(robot, q, axes):
        face, edge = (_ARM, BLUE) if joint in arm else (_BODY, "#6d7684")
        _polygon(axis, corners * down, face, edge, alpha=alpha)


def _polygon(axis: Any, corners: Any, face: str, edge: str, **style: Any) -> None:
    """Draw a filled polygon with corners (N, 2) in the axes of the view [m]."""
    axis.fill(*np.transpose(corners), facecolor=face, edgecolor=edge, linewidth=0.9, **style)


def _point(
    axis: Any, place: Any, letter: str, meaning: str, color: str, offset: tuple[float, float]
) -> None:
    """Draw a point at a place [m] with its letter and meaning, `offset` [pt] away."""
    axis.plot(*place, "o", color=color, markersize=7, zorder=8)
    text = rf"$\bf{{{letter}}}$" + (f"  {meaning}" if meaning else "")
    line = {"arrowstyle": "-", "color": color, "linewidth": 0.9} if meaning else None
    axis.annotate(text, place, offset, textcoords="offset points", color=color, ha="center",
                  va="center", zorder=10, bbox=_HALO, arrowprops=line)


def _arrow(axis: Any, start: Any, end: Any, style: str = "-|>", color: str = "k") -> None:
    """Draw an arrow between two places of the view [m]."""
    axis.annotate("", end, start, arrowprops={
        "arrowstyle": style, "color": color, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0})


def draw_plan(plan: ImpactPlan, robot: RobotModel, path: Path) -> None:
    """Write a figure of a plan; the file's suffix decides the format.

    Args:
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
