"""Kind ``push``: blows at the center of mass in mid single support of a walk."""

import math
from collections.abc import Iterator

import numpy as np
from walking.footsteps.footstep import Pose
from walking.pattern.walk_plan import WalkPlan

from door_impact_evaluation.run.walk_run import PUSH_DURATION, Push, plan_between, walk
from door_impact_evaluation.sweep.kind import Kind, Panel, Row, largest, smallest
from door_impact_evaluation.sweep.walk import measured, walker

GOALS = {"ahead": (1.2, 0.0), "sideways": (0.0, 0.6)}
"""Goal of each group: ahead and left [m]; every second walk sideways is to the right."""
BLOWS = {"fore and aft": (20.0, False), "sideways": (16.0, False), "any direction": (25.0, True)}
"""Size [N s] of each blow, and whether the robot may put its feet elsewhere after it."""


def draw(n: int, seed: int) -> list[Row]:
    """Draw n walks, each with each of the blows; goals take turns."""
    return [case for index in range(n) for case in _drawn(index, seed)]


def _drawn(index: int, seed: int) -> list[Row]:
    random = np.random.default_rng([seed, index])
    group = list(GOALS)[index % len(GOALS)]
    ahead, left = GOALS[group]
    place = float(random.uniform())  # which of the walk's steps, as a share
    fore = math.pi * float(random.integers(2))
    side = math.pi * (float(random.integers(2)) - 0.5)
    # As seen by the robot: 0 is ahead, a quarter turn is to the left [rad].
    directions = (fore, side, float(random.uniform(-math.pi, math.pi)))
    noise = int(random.integers(1 << 30))
    return [{"group": group, "index": index, "blow": blow, "direction": direction, "place": place,
             "goal": [ahead, (-1.0) ** (index // len(GOALS)) * left], "seed": noise}
            for blow, direction in zip(BLOWS, directions, strict=True)]


def push_of(case: Row, plan: WalkPlan) -> tuple[Push, str]:
    """Return the blow of a case in its walk, which keeps its heading, and the swinging foot."""
    step = int(case["place"] * len(plan.footsteps))
    phase = next(phase for phase in plan.schedule.phases
                 if phase.kind == "single" and phase.step == step)
    middle = 0.5 * (phase.first + phase.last) * plan.schedule.period
    direction, size = phase.stance.middle.yaw + case["direction"], BLOWS[case["blow"]][0]
    return Push(middle - 0.5 * PUSH_DURATION,
                (size * math.cos(direction), size * math.sin(direction), 0.0)), phase.swing


def run(case: Row) -> Iterator[Row]:
    """Simulate a walk with its blow, and measure it."""
    robot, start = walker(), Pose(0.0, 0.0, 0.0)
    plan = plan_between(robot, start, start.moved(*case["goal"]), keep_heading=True)
    (impulse, step_change), (push, swing) = BLOWS[case["blow"]], push_of(case, plan)
    walked = walk(robot, plan, [push], step_change=step_change, engine=case["engine"],
                  seed=case["seed"])
    # Share of the blow that points to the side of the swinging foot, from -1 to 1.
    outward = math.sin(case["direction"]) * (1.0 if swing == "left" else -1.0)
    yield {
        "impulse": impulse, "step_change": step_change, "at_s": push.at_s, "swing": swing,
        "direction_deg": math.degrees(case["direction"]), "outward": outward,
        **measured(walked), "changed": walked.execution.recovered > 0}


def summary(rows: list[Row]) -> Row:
    """Count the walks that stood after every blow."""
    fell = {row["index"] for row in rows if not row.get("stood")}
    return {"stood": len({row["index"] for row in rows} - fell)}


PUSH = Kind(
    "push", "pushes the walking robot, and reports whether it stood", draw, run,
    label=lambda row: str(row["blow"]),
    summary=summary, counts=("changed",), measures={"tilt_deg": largest, "margin_mm": smallest},
    worst="tilt_deg",
    panels=tuple(Panel(x, y, limits) for y, limits in (("tilt_deg", ()), ("margin_mm", (0.0,)))
                 for x in ("direction_deg", "outward", "place")))
