"""Kind ``push``: blows at the center of mass of a robot that walks, stands or holds the door."""

import math
import tempfile
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np
from door_model.door.config import load_door
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.placement import configured_settings
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from walking.footsteps.footstep import Pose
from walking.pattern.walk_plan import WalkPlan

from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.rehearsal import execute
from door_impact_evaluation.run.walk_run import (
    PUSH_DURATION,
    STANDING,
    Push,
    plan_between,
    push_standing,
    walk,
)
from door_impact_evaluation.sweep.kind import (
    Kind,
    Panel,
    Row,
    known,
    largest,
    robot_of,
    smallest,
)
from door_impact_evaluation.sweep.walk import measured

GOALS = {"ahead": (1.2, 0.0), "sideways": (0.0, 0.6)}
"""Goal of each group: ahead and left [m]; every second walk sideways is to the right."""
BLOWS = {"fore and aft": (20.0, False), "sideways": (16.0, False), "any direction": (25.0, True)}
"""Size [N s] of each blow in a walk, and whether the robot may put its feet elsewhere after it."""
STANDS = ("standing", "holding")
"""Groups that do not walk: in half-sitting, and the hand on the paper's door, hit to `HELD`."""
STANDING_BLOWS = {"20 N s": (20.0, False), "30 N s, steps": (30.0, True)}
"""As `BLOWS`, for each of `STANDS`."""
HELD = 25.0  # [deg]
_AWAY = 9.0  # distance to the door in half-sitting [m]
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # multiples of this angle are spread evenly [rad]


def draw(n: int, seed: int) -> list[Row]:
    """Draw n walks, each with each of the blows; goals take turns. A standing robot gets n more."""
    return [case for index in range(n) for case in _drawn(index, seed)] + [
        {"group": group, "index": index, "blow": f"{group}, {blow}",
         "direction": math.remainder(index * _GOLDEN, math.tau), "impulse": impulse,
         "step_change": steps, "seed": seed + index}
        for group in STANDS for blow, (impulse, steps) in STANDING_BLOWS.items()
        for index in range(n)]


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
    """Simulate a robot with its blow, and measure it."""
    if case["group"] in STANDS:
        yield _stands(case)
        return
    robot, start = robot_of(case), Pose(0.0, 0.0, 0.0)
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


def _stands(case: Row) -> Row:
    """Push a robot that stands, and measure it from then on."""
    robot, plan, place = robot_of(case), None, (_AWAY, -_AWAY)
    if case["group"] == "holding":
        plan = _hit(robot)
        place = (plan.hit.placement.door_distance, plan.hit.placement.hinge_x)
    world = World(
        robot.config, load_door("paper"), *place, engine=case["engine"], seed=case["seed"])
    size, angle = case["impulse"], case["direction"]
    try:
        if plan is not None:
            execute(world, robot, plan)
        begin = world.time + STANDING
        stepped = push_standing(
            world, robot, (size * math.cos(angle), size * math.sin(angle), 0.0),
            step_change=case["step_change"])
        with tempfile.TemporaryDirectory() as folder:
            log = simulation_log.load(world.save_log(Path(folder) / "log.npz"), begin)
    finally:
        world.close()
    margin = evaluation.support(log.motion, robot.config, window=evaluation.WINDOW).margin
    return {
        "direction_deg": math.degrees(angle), "stood": not log.fell, "fell": log.fell,
        "changed": stepped, "margin_mm": 1e3 * float(known(margin).min(initial=np.inf)),
        "tilt_deg": math.degrees(evaluation.tilt(log.motion.base_orientation).max())}


@lru_cache(maxsize=1)
def _hit(robot: RobotModel) -> ImpactPlan:
    return plan_impact(PlanRequest(math.radians(HELD)), KnownDoor.configured(load_door("paper")),
                       robot, configured_settings(robot))


def summary(rows: list[Row]) -> Row:
    """Count the walks that stood after every blow."""
    rows = [row for row in rows if row["group"] in GOALS]
    fell = {row["index"] for row in rows if not row.get("stood")}
    return {"stood": len({row["index"] for row in rows} - fell)}


PUSH = Kind(
    "push", "pushes the robot that walks, stands or holds the door, and reports whether it stood",
    draw, run, label=lambda row: str(row["blow"]),
    summary=summary, counts=("changed",), measures={"tilt_deg": largest, "margin_mm": smallest},
    worst="tilt_deg",
    panels=tuple(Panel(x, y, limits) for y, limits in (("tilt_deg", ()), ("margin_mm", (0.0,)))
                 for x in ("direction_deg", "outward", "place")))
