"""Kind ``miss``: hits whose door is not there, by run-ups up to the fastest ones."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from impact_planner.motion.missed import needed_reserve

from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
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

AWAY = 6.0              # distance by which the door stands farther away than it was surveyed [m]
TARGETS = (15.0, 30.0)  # range of the desired opening angles [deg]
FRICTION = (0.5, 1.0)   # range of the friction coefficient of the soles
GROUPS = {"paper": (("paper",), "mcv50"), "size2": (("size2",), "zmp_limited"),
          "fast": (("size3", "size4"), "zmp_limited")}
"""Doors and run-up of each group: the paper's, a faster one, and the fastest."""


def draw(n: int, seed: int) -> list[Row]:
    """Draw n cases in each group."""
    return [_drawn(group, index, seed) for group in GROUPS for index in range(n)]


def _drawn(group: str, index: int, seed: int) -> Row:
    random = np.random.default_rng([seed, index, list(GROUPS).index(group)])
    doors, run_up = GROUPS[group]
    return {"group": group, "index": index, "door": doors[index % len(doors)], "run_up": run_up,
            "target_deg": float(random.uniform(*TARGETS)),
            "friction": float(random.uniform(*FRICTION)), "seed": int(random.integers(1 << 30))}


def run(case: Row) -> Iterator[Row]:
    """Simulate a missed hit without a probe, and once more with one if the plan asks for it."""
    for probe in ("off", "auto"):
        with tempfile.TemporaryDirectory() as folder:
            found = rehearse(
                case["target_deg"], Path(folder) / "log.npz", door_offset=AWAY, probe=probe,
                robot=robot_of(case), **{
                    name: case[name] for name in ("door", "run_up", "engine", "friction", "seed")})
        yield _measured(found)
        if found.plan.missed_margin >= needed_reserve(found.robot):
            return


def _measured(found: Rehearsal) -> Row:
    plan, motion, stands = found.plan, found.log.motion, found.log.stood
    expected = plan.missed_margin >= needed_reserve(found.robot)
    margin = evaluation.support(motion, found.robot, window=evaluation.WINDOW).margin
    return {
        "outcome": found.execution.outcome.value, "stood": stands, "fell": found.log.fell,
        "missed_margin_mm": 1e3 * plan.missed_margin, "v_rb": plan.v_rb,
        # Falls of which the plan warned, of which it did not, and warnings of no fall.
        "announced": not (stands or expected),
        "unannounced": not stands and expected,
        "needless": stands and not expected,
        "margin_mm": 1e3 * float(known(margin).min(initial=np.inf)),
        "tilt_deg": float(np.degrees(evaluation.tilt(motion.base_orientation).max()))}


def summary(rows: list[Row]) -> Row:
    """Compute the figures of the paper's door without a probe."""
    paper = [row for row in rows if row["group"] == "paper" and row["run"] == 0]
    margins = smallest(row.get("margin_mm") for row in paper)
    return {"stood": count(paper, "stood"), "min_margin_mm": margins}


MISS = Kind(
    "miss", "hits where there is no door, and reports whether the robot stood or was to fall",
    draw, run, label=lambda row: row["group"] + (", probed" if row["run"] else ""),
    summary=summary, counts=("announced", "unannounced", "needless"),
    measures={"missed_margin_mm": smallest, "margin_mm": smallest, "tilt_deg": largest},
    worst="tilt_deg",
    panels=(Panel("target_deg", "missed_margin_mm", (0.0,)),
            Panel("missed_margin_mm", "tilt_deg"), Panel("missed_margin_mm", "margin_mm", (0.0,)),
            Panel("friction", "tilt_deg"), Panel("v_rb", "tilt_deg")))
