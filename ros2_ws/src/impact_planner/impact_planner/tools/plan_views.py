"""The paper's Fig. 5 for a plan: the robot at the hit, seen from behind and from above.

In every view the door is on the right, so that y increases to the left. All drawing functions take
a Matplotlib axis, the plan, the robot where its bodies are drawn, and the scene of the plan.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.palette import BLUE, GREEN, GREY, PURPLE, VERMILION
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel

from impact_planner.hit.leaf import LeafFrame
from impact_planner.impact_plan import ImpactPlan
from impact_planner.tools.outlines import body_outlines, skeleton
from impact_planner.tools.plan_scene import PlanScene

BROWN = "#8b5a2b"
_BODY = {"facecolor": "#e6e8ec", "edgecolor": "#6d7684", "linewidth": 0.8}
_ARM = {"facecolor": "#c3d5ea", "edgecolor": BLUE, "linewidth": 0.8}
_LEAF = {"facecolor": "#e2c9a6", "edgecolor": BROWN, "linewidth": 1.0}
_GHOST = {"facecolor": "none", "edgecolor": GREEN, "linewidth": 0.8}
_SOLE = {"facecolor": "#9aa3af", "edgecolor": "#3c4451", "linewidth": 0.9}
_BEHIND, _ABOVE = np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
_DIMENSION = {"arrowstyle": "<->", "color": "k", "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
_HALO = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8}


def draw_front(axis: Any, plan: ImpactPlan, robot: RobotModel, scene: PlanScene) -> None:
    """Draw the robot at the hit in the plane of y and z, Fig. 5 (a)."""
    arm = _arm_joints(robot)
    outlines = body_outlines(robot, scene.q_hit, (1, 2), _BEHIND)
    limbs = skeleton(robot, scene.q_hit)
    for limb in limbs:
        axis.plot(limb[:, 1], limb[:, 2], color="#b4bac4", linewidth=4.0, zorder=0.5)
    for outline in outlines:
        _polygon(axis, outline.points, **(_ARM if outline.joint in arm else _BODY))
    for side in SIDES:
        y = scene.feet[side][1] + np.array(robot.feet[side].rectangle[2:])
        axis.plot(y, [0.0, 0.0], color="k", linewidth=4.0, solid_capstyle="butt", zorder=4)
    points = np.vstack([limbs[..., 1:].reshape(-1, 2), *(each.points for each in outlines)])
    top, left = float(points[:, 1].max()), float(points[:, 0].max())
    _front_door(axis, plan, scene, top + 0.14)
    _front_letters(axis, plan, scene, left)
    _front_speed(axis, plan, scene, top)
    axis.set(title="(a) at the hit, from behind (Fig. 5 (a))", xlabel="y [m]", ylabel="z [m]")
    _frame(axis, (float(scene.b[1]) - 0.34, left + 0.42), (-0.14, top + 0.12))


def _front_door(axis: Any, plan: ImpactPlan, scene: PlanScene, top: float) -> None:
    """Draw a section of the leaf at B, the floor and the impulse up to the height `top` [m]."""
    b = scene.b
    depth = scene.thickness / math.cos(plan.initial_angle)
    _polygon(axis, np.array([[b[1], 0.0], [b[1] - depth, 0.0], [b[1] - depth, top], [b[1], top]]),
             **_LEAF)
    axis.axhline(0.0, color="k", linewidth=1.0, zorder=1)
    start, end = b[1] - depth - 0.01, b[1] - depth - 0.17
    axis.annotate("", (end, b[2]), (start, b[2]),
                  arrowprops={"arrowstyle": "-|>", "color": PURPLE, "linewidth": 2.2,
                              "shrinkA": 0.0, "shrinkB": 0.0})
    axis.text(start - 0.01, b[2] + 0.03, f"impulse\n{plan.required_impulse:.1f} N s", color=PURPLE,
              ha="left", va="bottom")
    axis.text(start - 0.01, 0.25, "leaf", color=BROWN, ha="left")


def _front_speed(axis: Any, plan: ImpactPlan, scene: PlanScene, top: float) -> None:
    """Draw the arrow of v_rB between head and leaf at the height `top` [m]."""
    start, end = float(scene.b[1]) + 0.22, float(scene.b[1]) + 0.04
    axis.annotate("", (end, top), (start, top), arrowprops={
        "arrowstyle": "-|>", "color": "k", "linewidth": 1.6, "shrinkA": 0.0, "shrinkB": 0.0})
    axis.text(end, top - 0.02, f"$v_{{rB}}$\n{plan.v_rb:.3f} m/s", ha="right", va="top")


def _front_letters(axis: Any, plan: ImpactPlan, scene: PlanScene, left: float) -> None:
    """Draw G, B and C, and the heights a_r and b_r left of the y coordinate `left` [m]."""
    g, b, c = scene.com, scene.b, scene.c
    at = left + 0.10
    for y, z in ((g[1], g[2]), (b[1], b[2])):
        axis.plot([y, at + 0.03], [z, z], color="k", linewidth=0.6, linestyle=(0, (4, 3)), zorder=5)
    for low, high, name in ((0.0, g[2], f"$b_r$\n{plan.b_r:.3f} m"),
                            (g[2], b[2], f"$a_r$\n{plan.a_r:.3f} m")):
        axis.annotate("", (at, high), (at, low), arrowprops=_DIMENSION)
        axis.text(at + 0.02, 0.5 * (low + high), name, ha="right", va="center")
    axis.plot([g[1], g[1]], [0.0, g[2]], color=BLUE, linewidth=1.0, linestyle="--", zorder=5)
    _com_symbol(axis, g[1], g[2])
    axis.plot(g[1], 0.0, "v", color=BLUE, markersize=6, zorder=7)
    axis.plot(b[1], b[2], "o", color=PURPLE, markersize=6, zorder=7)
    axis.plot(c[1], 0.0, "o", color="k", markersize=5, zorder=7)
    _label(axis, "G", (g[1], g[2]), (8, 7), BLUE)
    _label(axis, "B", (b[1], b[2]), (-9, 9), PURPLE)
    _label(axis, "projection of G", (g[1], 0.0), (26, -16), BLUE, leader=True)
    _label(axis, "C", (c[1], 0.0), (-22, -16), "k", leader=True)


def draw_top(axis: Any, plan: ImpactPlan, robot: RobotModel, scene: PlanScene) -> None:
    """Draw robot and door in the plane of y and x with step and ending, Fig. 5 (b)."""
    arm = _arm_joints(robot)
    outlines = body_outlines(robot, scene.q_hit, (1, 0), _ABOVE)
    for outline in outlines:
        _polygon(axis, outline.points, alpha=0.55, **(_ARM if outline.joint in arm else _BODY))
    _soles(axis, robot, scene)
    _top_door(axis, plan, scene)
    ending = _top_ending(axis, plan, robot, scene)
    axis.plot(scene.b[1], scene.b[0], "o", color=PURPLE, markersize=6, zorder=8)
    _com_symbol(axis, scene.com[1], scene.com[0])
    _label(axis, "G", (scene.com[1], scene.com[0]), (2, 9), BLUE)
    _label(axis, "B", (scene.b[1], scene.b[0]), (-9, 8), PURPLE)
    leaf = [scene.leaf_corners(angle)[:, ::-1] for angle in (0.0, plan.desired_opening_angle)]
    points = np.vstack([ending, *leaf, *(outline.points for outline in outlines)])
    low, high = points.min(axis=0), points.max(axis=0)
    axis.set(title="(b) from above (Fig. 5 (b))", xlabel="y [m]", ylabel="x [m]")
    _frame(axis, (low[0] - 0.08, high[0] + 0.05), (low[1] - 0.08, high[1] + 0.08))


def _top_ending(axis: Any, plan: ImpactPlan, robot: RobotModel, scene: PlanScene) -> Array:
    """Draw the arm that holds the door, or the robot after its retreat.

    Returns:
        Points of what was drawn as y and x, (N, 2) [m].
    """
    held, arm = plan.ending == "hold", _arm_joints(robot)
    outlines = [
        outline.points for outline in body_outlines(robot, scene.q_end, (1, 0), _ABOVE)
        if outline.joint in arm or not held]
    for points in outlines:
        _polygon(axis, points, **_GHOST)
    every = np.vstack([skeleton(robot, scene.q_end)[..., 1::-1].reshape(-1, 2), *outlines])
    if held:
        for name, place in (("elbow", scene.elbow_end), ("hand", scene.hand_end)):
            axis.plot(place[1], place[0], "o", color=GREEN, markersize=4, zorder=7)
            _label(axis, name, (place[1], place[0]), (-20, 16), GREEN, leader=True)
    else:
        corner = every[np.argmax(every[:, 1] + 0.3 * every[:, 0])]
        _label(axis, "back after retreat", tuple(corner), (0, 16), GREEN, leader=True)
    return every


def _top_door(axis: Any, plan: ImpactPlan, scene: PlanScene) -> None:
    """Draw the leaf at the hit and at the desired angle, with hinge, l_B and arc."""
    hit, desired = plan.initial_angle, plan.desired_opening_angle
    if hit > 0.0:
        _polygon(axis, scene.leaf_corners(0.0)[:, ::-1], facecolor="none", edgecolor=BROWN,
                 linestyle=":", linewidth=0.8)
    _polygon(axis, scene.leaf_corners(hit)[:, ::-1], **_LEAF)
    _polygon(axis, scene.leaf_corners(desired)[:, ::-1], alpha=0.6, linestyle="--", **_LEAF)
    for radius in (scene.width, plan.l_b):
        arc = scene.arc(radius, hit, desired)
        axis.plot(arc[:, 1], arc[:, 0], color=BROWN, linewidth=0.8, linestyle=":")
    arc = scene.arc(0.72 * plan.l_b, 0.0, desired)
    axis.annotate("", arc[-1, ::-1], arc[0, ::-1], arrowprops={
        "arrowstyle": "-|>", "color": BROWN, "linewidth": 1.0, "shrinkA": 0.0, "shrinkB": 0.0,
        "connectionstyle": f"arc3,rad={-0.5 * math.tan(0.25 * desired):.3f}"})
    middle = LeafFrame(scene.hinge, 0.5 * (hit + desired)).point(0.72 * plan.l_b, 0.0, 0.0)
    axis.text(middle[1], middle[0] + 0.02, f"{math.degrees(desired):.1f}°", color=BROWN,
              ha="center", va="bottom")
    for angle, name in ((hit, "at the hit"), (desired, "desired")):
        edge = scene.leaf_corners(angle)[1:3]
        axis.text(edge[:, 1].mean(), edge[:, 0].max() + 0.015, name, color=BROWN, ha="center",
                  va="bottom")
    _dimension_l_b(axis, plan, scene)
    axis.plot(scene.hinge[1], scene.hinge[0], "o", color=BROWN, markersize=7, zorder=8)
    _label(axis, "A, hinge", (scene.hinge[1], scene.hinge[0]), (0, -14), BROWN)


def _dimension_l_b(axis: Any, plan: ImpactPlan, scene: PlanScene) -> None:
    """Draw the dimension l_B along the leaf at the hit, on the robot's side."""
    leaf = LeafFrame(scene.hinge, plan.initial_angle)
    ends = [leaf.point(radius, 0.0, 0.09)[:2] for radius in (0.0, plan.l_b)]
    feet = [leaf.point(radius, 0.0, 0.0)[:2] for radius in (0.0, plan.l_b)]
    for end, foot in zip(ends, feet, strict=True):
        axis.plot([foot[1], end[1]], [foot[0], end[0]], color="k", linewidth=0.6)
    axis.annotate("", ends[1][::-1], ends[0][::-1], arrowprops=_DIMENSION)
    middle = 0.5 * (ends[0] + ends[1])
    axis.text(middle[1] + 0.015, middle[0], f"$l_B$ {plan.l_b:.3f} m", ha="right", va="center")


def draw_floor(axis: Any, plan: ImpactPlan, robot: RobotModel, scene: PlanScene) -> None:
    """Draw the soles enlarged, with the courses of CoM and ZMP in the run-up."""
    from matplotlib.patches import Rectangle

    _polygon(axis, scene.support[:, ::-1], facecolor="#eef3ea", edgecolor=GREEN, linewidth=1.0,
             label="support polygon at the hit")
    _soles(axis, robot, scene)
    com, zmp, (first, last) = scene.com_course, scene.zmp_course, scene.steady
    axis.text(0.5 * (scene.feet_start["right"][1] + scene.feet["right"][1]),
              _step_x(robot, scene), f"step {plan.hit.stance.step:.3f} m", ha="center",
              va="center", zorder=9, bbox=_HALO)
    axis.add_patch(Rectangle(
        (last[1], last[0] - 0.02), first[1] - last[1], 0.04, color=PURPLE, alpha=0.4,
        linewidth=0.0, zorder=5, label="steady stretch"))
    axis.plot(com[:, 1], com[:, 0], color=BLUE, linewidth=5.0, alpha=0.45, zorder=6,
              label="CoM, run-up")
    axis.plot(zmp[:, 1], zmp[:, 0], color=VERMILION, linewidth=1.2, zorder=7, label="ZMP, run-up")
    marks = [
        ("start", com[0], "o", BLUE, (0, 26)), ("hit", scene.com, "o", BLUE, (26, 20)),
        ("C", scene.c, "o", "k", (-16, 20))]
    marks.append(("point of no return", scene.no_return, "x", "k", (-10, -36)))
    for name, place, marker, color, offset in marks:
        axis.plot(place[1], place[0], marker, color=color, markersize=5, markeredgewidth=1.4,
                  zorder=9)
        _label(axis, name, (float(place[1]), float(place[0])), offset, color, leader=True)
    every = np.vstack([scene.support, *(
        robot.feet[side].corners(scene.feet_start[side]) for side in SIDES)])
    low, high = every.min(axis=0), every.max(axis=0)
    axis.set(title="(c) feet, enlarged", xlabel="y [m]", ylabel="x [m]")
    _frame(axis, (low[1] - 0.02, high[1] + 0.02), (low[0] - 0.02, high[0] + 0.02))
    legend_below(axis, 4)


def legend_below(axis: Any, columns: int) -> None:
    """Draw a legend below the label of the x axis, where it hides nothing."""
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=columns, frameon=False,
                columnspacing=1.0, handlelength=1.4)


def _step_x(robot: RobotModel, scene: PlanScene) -> float:
    """x at which the step is drawn, near the toes [m]."""
    return float(scene.feet["right"][0]) + robot.feet["right"].rectangle[1] - 0.03


def _soles(axis: Any, robot: RobotModel, scene: PlanScene) -> None:
    """Draw the soles at the start and at the hit from above, and the step."""
    start, end = scene.feet_start["right"], scene.feet["right"]
    _polygon(axis, robot.feet["right"].corners(start)[:, ::-1], facecolor="none",
             edgecolor=_SOLE["edgecolor"], linestyle="--", linewidth=0.9, zorder=3)
    for side in SIDES:
        _polygon(axis, robot.feet[side].corners(scene.feet[side])[:, ::-1], alpha=0.6, zorder=3,
                 **_SOLE)
    x = _step_x(robot, scene)
    axis.annotate("", (end[1], x), (start[1], x), zorder=6, arrowprops={
        "arrowstyle": "-|>", "color": "k", "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0})


def _arm_joints(robot: RobotModel) -> set[int]:
    """Pinocchio's indices of the right arm's joints."""
    shoulder = robot.model.getJointId(robot.config.arm.joints[0])
    return set(robot.model.subtrees[shoulder])


def _polygon(axis: Any, points: Array, **style: Any) -> None:
    """Draw a closed polygon with corners (N, 2) in the axes of the view [m]."""
    from matplotlib.patches import Polygon

    axis.add_patch(Polygon(points, closed=True, **style))


def _com_symbol(axis: Any, across: float, up: float) -> None:
    """Draw the symbol of a CoM, a half-filled disc, at a place of the view [m]."""
    axis.plot(across, up, "o", color=BLUE, markersize=10, markerfacecolor="white",
              markeredgewidth=1.3, zorder=8)
    axis.plot(across, up, marker="o", markersize=8, fillstyle="left", color=BLUE,
              markerfacecoloralt="white", markeredgewidth=0.0, zorder=8)


def _label(
    axis: Any, text: str, place: tuple[float, float], offset: tuple[float, float], color: str,
    *, leader: bool = False,
) -> None:
    """Draw a text at an offset [points] from a place [m], with a line between where `leader`."""
    arrow = {"arrowstyle": "-", "color": color, "linewidth": 0.8, "shrinkB": 3.0}
    axis.annotate(text, place, offset, textcoords="offset points", color=color, ha="center",
                  va="center", zorder=10, bbox=_HALO, arrowprops=arrow if leader else None)


def _frame(axis: Any, across: tuple[float, float], up: tuple[float, float]) -> None:
    """Set limits [m] and equal scales; the horizontal axis is reversed."""
    axis.set_aspect("equal")
    axis.set(xlim=across[::-1], ylim=up)
    axis.grid(color=GREY, alpha=0.2)
    axis.set_axisbelow(True)
