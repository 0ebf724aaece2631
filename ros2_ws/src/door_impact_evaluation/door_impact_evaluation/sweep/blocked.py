"""Kind ``blocked``: locked doors, which are hit at once, or found to be locked by a touch before.

The touch is the probe of `rehearse`.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from door_model.door.config import load_door
from hrp2_description.robot import needed
from robot_driver.motion import Outcome

from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from door_impact_evaluation.sweep import miss
from door_impact_evaluation.sweep.kind import (
    Kind,
    Panel,
    Row,
    count,
    known,
    largest,
    robot_of,
    smallest,
)

PLAY = 3.0  # largest play of a bolt at the leaf's free edge [mm]
WAYS = {"hit": "off", "probe": "on"}
"""What `rehearse` is told about the probe, for each way to meet the leaf, in their order."""


def draw(n: int, seed: int) -> list[Row]:
    """Draw the cases of misses, and a bolt for each; half of the bolts have play."""
    return [case | {"play_mm": _play(case)} for case in miss.draw(n, seed)]


def _play(case: Row) -> float:
    has_play = case["index"] // len(miss.GROUPS[case["group"]][0]) % 2
    return has_play * float(np.random.default_rng(case["seed"]).uniform(0.0, PLAY))


def run(case: Row) -> Iterator[Row]:
    """Meet the locked leaf in each of `WAYS`, and measure it."""
    opens_to = 1e-3 * case["play_mm"] / load_door(case["door"]).leaf.width
    with tempfile.TemporaryDirectory() as folder:
        for probe in WAYS.values():
            yield measured(rehearse(
                case["target_deg"], Path(folder) / "log.npz", probe=probe, opens_to=opens_to,
                robot=robot_of(case), **{
                    name: case[name] for name in ("door", "run_up", "engine", "friction", "seed")}))


def measured(found: Rehearsal) -> Row:
    """Evaluate a run by the simulation's log; `ratchet_share` is that of the heaviest gear."""
    robot, plan, motion = found.robot, found.plan, found.log.motion
    margin = evaluation.support(motion, robot, window=evaluation.WINDOW).margin
    row: Row = {
        "outcome": found.execution.outcome.value, "stood": found.log.stood, "fell": found.log.fell,
        "found": found.execution.outcome is Outcome.LOCKED,
        "v_rb": plan.v_rb, "missed_margin_mm": 1e3 * plan.missed_margin,
        "margin_mm": 1e3 * float(known(margin).min(initial=np.inf)),
        "tilt_deg": float(np.degrees(evaluation.tilt(motion.base_orientation).max())),
        "peak_force_n": float(motion.contact_force.max())}
    if found.impact is None:
        return row
    gears = found.log.hit_loads(found.impact).gears
    shares = np.array([*gears.values()]) / needed(robot.drives, "drives").ratcheting_torque
    return row | {"ratchet_share": float(shares.max()), "gear": [*gears][int(shares.argmax())]}


def summary(rows: list[Row]) -> Row:
    """Count the runs of each way after which the robot stood, and the leaves that were found."""
    ways = {way: [row for row in rows if row["run"] == number] for number, way in enumerate(WAYS)}
    return {"stood": {way: count(found, "stood") for way, found in ways.items()},
            "found": count(ways["probe"], "found")}


BLOCKED = Kind(
    "blocked", "hits and probes of locked doors, and reports whether the robot noticed and stood",
    draw, run, label=lambda row: f"{row['group']}, {[*WAYS][row['run']]}",
    summary=summary, counts=("found",),
    measures={"tilt_deg": largest, "margin_mm": smallest, "peak_force_n": largest,
              "ratchet_share": largest},
    worst="tilt_deg",
    panels=(Panel("v_rb", "tilt_deg"), Panel("v_rb", "margin_mm", (0.0,)),
            Panel("v_rb", "peak_force_n"), Panel("v_rb", "ratchet_share", (1.0,)),
            Panel("missed_margin_mm", "tilt_deg"), Panel("play_mm", "tilt_deg"),
            Panel("friction", "tilt_deg"), Panel("target_deg", "tilt_deg")))
