"""Draw docs/robot_and_door.png: HRP-2 at the hit, from the front and from above.

Everything is taken from the plan for the paper's door and 25 deg. In both views y grows to the
right, so the door is on the left. Run it with `.venv/bin/python docs/robot_and_door.py`.
"""

import argparse
import math
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.palette import BLUE, PURPLE
from door_model.door.config import load_door
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.tools.outlines import body_outlines, skeleton
from impact_planner.tools.plan_scene import PlanScene, plan_scene
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

ANGLE = math.radians(25.0)  # desired opening angle [rad]
FRONT, ABOVE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])  # from the robot to the eye
TOP = 1.55  # height at which the leaf is cut off in the front view [m]
BODY, ARM, LEAF, SOLE = "#e8eaee", "#c3d5ea", "#e2c9a6", "#9aa3af"
BROWN = "#7a4a1e"
HALO = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}


def main(args: list[str] | None = None) -> None:
    """Plan the hit and draw both views into one picture."""
    parser = argparse.ArgumentParser(description="Draw robot and door at the hit.")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".png"))
    out = parser.parse_args(args).out
    robot = RobotModel(load_robot_config())
    plan = plan_impact(PlanRequest(ANGLE), KnownDoor.configured(load_door("paper")), robot)
    scene = plan_scene(plan, robot)

    figure = Figure(figsize=(10.0, 4.9), layout="constrained")
    FigureCanvasAgg(figure)
    front, above = figure.subplots(1, 2, width_ratios=[1.0, 1.12])
    draw_front(front, plan, robot, scene)
    draw_above(above, plan, robot, scene)
    figure.savefig(out, dpi=110, metadata={"Software": None})


def draw_front(axis: Any, plan: ImpactPlan, robot: RobotModel, scene: PlanScene) -> None:
    """The robot at the hit in the plane of y and z."""
    g, b, c = scene.com, scene.b, scene.c
    leaf = b[1] - scene.thickness
    polygon(axis, [(leaf, 0.0), (b[1], 0.0), (b[1], TOP), (leaf, TOP)], LEAF, BROWN)
    for limb in skeleton(robot, scene.q_hit):
        axis.plot(limb[:, 1], limb[:, 2], color="#b4bac4", linewidth=4.0, zorder=0.5)
    draw_bodies(axis, robot, scene.q_hit, (1, 2), FRONT)
    for side in SIDES:
        across = scene.feet[side][1] + np.array(robot.feet[side].rectangle[2:])
        axis.plot(across, [0.0, 0.0], color="k", linewidth=5.0, solid_capstyle="butt", zorder=4)
    axis.axhline(0.0, color="k", linewidth=1.0)
    axis.plot([g[1], g[1]], [0.0, g[2]], color=BLUE, linewidth=1.0, linestyle="--", zorder=5)
    point(axis, (g[1], g[2]), "G", "center of mass", BLUE, (62, 24))
    point(axis, (b[1], b[2]), "B", "elbow", PURPLE, (-40, 14))
    point(axis, (c[1], 0.0), "C", "center of percussion", "k", (-58, -24))
    edge = 0.40
    for height in (g[2], b[2]):
        axis.plot([g[1] if height == g[2] else b[1], edge], [height, height], color="k",
                  linewidth=0.6, linestyle=(0, (4, 3)), zorder=0.2)
    for low, high, name in ((0.0, g[2], "$b_r$"), (g[2], b[2], "$a_r$")):
        dimension(axis, (edge, low), (edge, high))
        axis.text(edge + 0.03, 0.5 * (low + high), name, va="center")
    arrow(axis, (b[1] + 0.33, 1.30), (b[1] + 0.10, 1.30), "k")
    axis.text(b[1] + 0.215, 1.33, "$v_{rB}$", ha="center", va="bottom")
    axis.text(leaf - 0.02, 0.30, "leaf,\nclosed", color=BROWN, ha="right")
    frame(axis, "from the front", (leaf - 0.34, 0.55), (-0.2, TOP), "y [m]", "z [m]")


def draw_above(axis: Any, plan: ImpactPlan, robot: RobotModel, scene: PlanScene) -> None:
    """Robot and door in the plane of y and -x: the robot looks down the page."""
    for angle, line, shade in ((ANGLE, "--", 0.5), (0.0, "-", 1.0)):
        polygon(axis, turned(scene.leaf_corners(angle)), LEAF, BROWN, linestyle=line, alpha=shade)
    draw_bodies(axis, robot, scene.q_hit, (1, 0), ABOVE, alpha=0.5)
    for side in SIDES:
        corners = turned(robot.feet[side].corners(scene.feet[side]))
        polygon(axis, corners, SOLE, "k", alpha=0.55)
    for radius in (plan.l_b, scene.width):
        arc = turned(scene.arc(radius, 0.0, ANGLE))
        axis.plot(arc[:, 0], arc[:, 1], color=BROWN, linewidth=0.9, linestyle=":")
    arc = turned(scene.arc(0.66 * scene.width, 0.0, ANGLE))
    axis.annotate("", arc[-1], arc[-4], arrowprops={"arrowstyle": "-|>", "color": BROWN})
    axis.plot(arc[:, 0], arc[:, 1], color=BROWN, linewidth=1.4)
    axis.text(*(arc[20] + [0.0, -0.03]), r"$\theta$ = 25°", color=BROWN, ha="center", va="top")
    hinge, b, g, c = (turned(place[None, :2])[0] for place in (
        scene.hinge, scene.b, scene.com, scene.c))
    point(axis, hinge, "A", "hinge", BROWN, (40, 6))
    point(axis, b, "B", "", PURPLE, (13, -10))
    point(axis, g, "G", "", BLUE, (-10, 9))
    point(axis, c, "C", "", "k", (12, -10))
    beside = np.array([0.14, 0.0])
    dimension(axis, hinge + beside, [hinge[0] + beside[0], b[1]])
    for place in (hinge, b):
        axis.plot([place[0], hinge[0] + beside[0]], [place[1]] * 2, color="k", linewidth=0.6)
    axis.text(hinge[0] + beside[0] + 0.02, 0.6 * hinge[1] + 0.4 * b[1], "$l_B$", va="center",
              bbox=HALO)
    axis.text(g[0], g[1] - 0.30, "the robot looks\ndown the page", color="#555e6b",
              ha="center", va="top")
    points = np.vstack([turned(scene.leaf_corners(angle)) for angle in (0.0, ANGLE)])
    frame(axis, "from above", (points[:, 0].min() - 0.06, 0.30),
          (points[:, 1].min() - 0.06, points[:, 1].max() + 0.08), "y [m]", "-x [m]")


def turned(places: Array) -> Array:
    """Places (N, 2) of x and y in odom as the page of the view from above has them: y and -x."""
    return np.column_stack([places[:, 1], -places[:, 0]])


def draw_bodies(axis: Any, robot: RobotModel, q: Array, axes: tuple[int, int], eye: Array,
                alpha: float = 1.0) -> None:
    """The robot's bodies, the farthest first; the arm that hits has a colour of its own."""
    shoulder = robot.model.getJointId(robot.config.arm.joints[0])
    arm = set(robot.model.subtrees[shoulder])
    for outline in body_outlines(robot, q, axes, eye):
        corners = outline.points * [1.0, -1.0] if axes[1] == 0 else outline.points
        hits = outline.joint in arm
        polygon(axis, corners, ARM if hits else BODY, BLUE if hits else "#6d7684", alpha=alpha)


def polygon(axis: Any, corners: Any, face: str, edge: str, **style: Any) -> None:
    """A filled polygon."""
    axis.add_patch(Polygon(corners, closed=True, facecolor=face, edgecolor=edge, linewidth=0.9,
                           **style))


def point(axis: Any, place: Any, letter: str, meaning: str, color: str,
          offset: tuple[float, float]) -> None:
    """A point with its letter and what it is, `offset` points away."""
    axis.plot(*place, "o", color=color, markersize=7, zorder=8)
    text = f"$\\bf{{{letter}}}$" + (f"  {meaning}" if meaning else "")
    far = math.hypot(*offset) > 20.0
    line = {"arrowstyle": "-", "color": color, "linewidth": 0.9} if far else None
    axis.annotate(text, place, offset, textcoords="offset points", color=color, ha="center",
                  va="center", zorder=10, bbox=HALO, arrowprops=line)


def dimension(axis: Any, start: Any, end: Any) -> None:
    """A line with an arrow head at both ends."""
    axis.annotate("", end, start, arrowprops={"arrowstyle": "<->", "shrinkA": 0.0, "shrinkB": 0.0})


def arrow(axis: Any, start: Any, end: Any, color: str) -> None:
    """An arrow from start to end."""
    axis.annotate("", end, start, arrowprops={
        "arrowstyle": "-|>", "color": color, "linewidth": 1.8, "shrinkA": 0.0, "shrinkB": 0.0})


def frame(axis: Any, title: str, across: tuple[float, float], up: tuple[float, float],
          across_name: str, up_name: str) -> None:
    """Title, limits and equal scales."""
    axis.set(title=title, xlim=across, ylim=up, xlabel=across_name, ylabel=up_name, aspect="equal")
    axis.grid(color="#8a9099", alpha=0.2)
    axis.set_axisbelow(True)


if __name__ == "__main__":
    main()
