"""Kind ``walk``: walks from anywhere, on floors and rubber that the plan does not know."""

import math
from collections.abc import Iterator

import numpy as np
from walking.footsteps.footstep import Pose

from door_impact_evaluation.run.walk_run import Walked, plan_between, walk
from door_impact_evaluation.sweep.kind import (
    Kind,
    Panel,
    Row,
    count,
    largest,
    robot_of,
    smallest,
)

GOALS = {"ahead": (5.0, 0.0, 0.0), "sideways": (0.0, 2.0, 0.0), "turn": (0.0, 0.0, 360.0)}
"""Goal of each group: ahead [m], left [m] and turn [deg]; every second one is to the right."""
FRICTION = (0.4, 1.0)  # range of the friction coefficient of the soles
RUBBER = (0.7, 1.3)    # range of the factor of the stiffness of the soles' rubber
FARTHEST = 10.0        # largest distance of the start from the origin of odom [m]
OFF_SHARE, OFF_TURN = 0.02, 50.0  # largest error of the end: share of the way; of a turn [mm]
OFF_YAW = 3.0          # largest error of the heading at the end [deg]


def draw(n: int, seed: int) -> list[Row]:
    """Draw n cases; goals take turns."""
    return [_drawn(index, seed) for index in range(n)]


def _drawn(index: int, seed: int) -> Row:
    random = np.random.default_rng([seed, index])
    group = list(GOALS)[index % len(GOALS)]
    ahead, left, turn = GOALS[group]
    side = (-1.0) ** (index // len(GOALS))
    # Uniform over the area: the root of a uniform share of the largest distance.
    away, bearing = FARTHEST * math.sqrt(random.uniform()), random.uniform(-math.pi, math.pi)
    return {
        "group": group, "index": index,
        "goal": [ahead, side * left, side * math.radians(turn)],  # from the start [m, m, rad]
        "start": [away * math.cos(bearing), away * math.sin(bearing),
                  float(random.uniform(-math.pi, math.pi))],  # pose in odom [m, m, rad]
        "friction": float(random.uniform(*FRICTION)),
        "rubber_scale": float(random.uniform(*RUBBER)), "seed": int(random.integers(1 << 30))}


def run(case: Row) -> Iterator[Row]:
    """Simulate a walk, and measure it."""
    robot, start = robot_of(case), Pose(*case["start"])
    plan = plan_between(
        robot, start, start.moved(*case["goal"]), keep_heading=True, whole_turns=True)
    walked = walk(robot, plan, **{
        name: case[name] for name in ("engine", "friction", "rubber_scale", "seed")})
    yield {**measured(walked), **arrival(walked.off, case["goal"], walked.stood)}


def measured(walked: Walked) -> Row:
    """Return the figures of a walk: SI units, but mm and deg where a key says so."""
    return {
        "stood": walked.stood, "fell": walked.log.fell, "outcome": walked.execution.outcome.value,
        "changed_steps": walked.execution.recovered,
        "margin_mm": 1e3 * walked.margin, "tilt_deg": math.degrees(walked.max_tilt),
        "speed_share": walked.speed_share, "steps": len(walked.plan.footsteps),
        "planned_margin_mm": 1e3 * float(walked.plan.checks.margin.min())}


def arrival(off: Pose, goal: list[float], stood: bool) -> Row:
    """Return how far the end is off, also over what is allowed, and whether the robot arrived."""
    if not stood:
        return {"arrived": False}
    off_mm, yaw_deg, way = 1e3 * math.hypot(*off[:2]), math.degrees(off.yaw), math.hypot(*goal[:2])
    share = off_mm / (1e3 * OFF_SHARE * way if way else OFF_TURN)
    return {"ahead_mm": 1e3 * off.x, "left_mm": 1e3 * off.y, "yaw_deg": yaw_deg, "off_mm": off_mm,
            "off_share": share, "arrived": share <= 1.0 and abs(yaw_deg) <= OFF_YAW}


WALK = Kind(
    "walk", "walks ahead, sideways and around, and reports where they ended", draw, run,
    label=lambda row: str(row["group"]),
    summary=lambda rows: {"arrived": count(rows, "arrived")}, counts=("arrived",),
    measures={"off_mm": largest, "yaw_deg": largest, "tilt_deg": largest, "speed_share": largest,
              "margin_mm": smallest},
    worst="off_share",
    panels=tuple(Panel(x, y, limits) for y, limits in (
        ("off_share", (1.0,)), ("yaw_deg", (-OFF_YAW, OFF_YAW)), ("margin_mm", (0.0,)),
        ("tilt_deg", ())) for x in ("friction", "rubber_scale")))
