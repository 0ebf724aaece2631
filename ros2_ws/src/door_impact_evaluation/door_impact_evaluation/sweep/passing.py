"""Kind ``pass``: the robot hits a door open, catches the leaf, and walks through."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from door_model.door.config import DoorConfig
from door_model.door.geometry import DoorGeometry
from humanoid_motion.robot_model import RobotModel
from walking.passing.opening import HIT

from door_impact_evaluation.run import evaluation, passage_measures
from door_impact_evaluation.run.pass_run import Passed, pass_door
from door_impact_evaluation.sweep import hit
from door_impact_evaluation.sweep.kind import (
    Kind,
    Panel,
    Row,
    count,
    largest,
    robot_of,
    smallest,
)

DOORS = {"paper": "mcv50", "size2": "zmp_limited", "size3": "zmp_limited", "size4": "zmp_limited"}
"""Doors, which take turns, and the run-up of the hit on each."""
_LEAVES = 0.1  # time after the release in which the hand leaves the leaf [s]
WIDTHS = (0.8, 1.0)  # range of the leaf's width [m]


def draw(n: int, seed: int) -> list[Row]:
    """Draw n cases; doors take turns, and after each turn the hinge changes its side."""
    return [_drawn(index, seed) for index in range(n)]


def _drawn(index: int, seed: int) -> Row:
    random, door = np.random.default_rng([seed, index]), list(DOORS)[index % len(DOORS)]
    c_c, k_c, tau = random.uniform(*hit.CLOSER, 3).tolist()
    return {
        "group": door, "index": index, "door": door, "run_up": DOORS[door],
        "hinge": ("right", "left")[index // len(DOORS) % 2],
        "c_c_scale": c_c, "k_c_scale": k_c, "tau_scale": tau,
        "width": float(random.uniform(*WIDTHS)),
        "door_offset": float(random.uniform(-hit.DOOR_OFF, hit.DOOR_OFF)),
        "friction": float(random.uniform(*hit.FRICTION)),
        "pushes_deg": random.uniform(*hit.PEAKS_DEG, hit.PUSHES).tolist(),
        "phase": float(random.uniform()), "seed": int(random.integers(1 << 30))}


def simulated_door(case: Row) -> DoorConfig:
    """Return the door of a case as it is simulated; its leaf's mass grows with the width."""
    plain, width = hit.simulated_door(case), case["width"]
    leaf = replace(plain.leaf, width=width, mass=plain.leaf.mass * width / plain.leaf.width)
    geometry = DoorGeometry(plain.name, plain.leaf, plain.linkage, plain.frame).with_leaf(leaf)
    return replace(plain, leaf=leaf, frame=geometry.frame, hinge=case["hinge"],
                   i_a=leaf.moment_of_inertia())


def run(case: Row) -> Iterator[Row]:
    """Simulate a passage, and measure it; one without a plan is refused before any motion."""
    door = simulated_door(case)
    with tempfile.TemporaryDirectory() as folder:
        yield measured(robot_of(case), pass_door(
            Path(folder) / "log.npz", door=door, known=hit.known_door(case, door), opening=HIT,
            robot=robot_of(case), **{
                name: case[name] for name in (
                    "door_offset", "run_up", "engine", "friction", "seed")}))


def measured(robot: RobotModel, found: Passed) -> Row:
    """Return the figures of a passage as in `passage_measures.summary`, and others."""
    record, plan = found.record, found.plan
    walk, log = record.walk, record.log
    assert found.hit is not None
    figures = passage_measures.summary(record, robot)
    return {
        "stood": log.stood, "fell": log.fell, "why": found.why,
        "margin_mm": figures.pop("min_margin_mm"), **figures,
        "target_deg": float(np.degrees(found.hit.desired_opening_angle)),
        "nearest": None if walk is None else passage_measures.nearest(walk, robot)[1],
        "contact_share": None if walk is None else passage_measures.contact_share(
            record, walk.release),
        "after_release_n": None if walk is None else float(log.motion.contact_force[
            log.motion.t > walk.release + _LEAVES].max(initial=0.0)),
        "frame_force_n": float(log.frame_force.max()),
        "tilt_deg": float(np.degrees(
            evaluation.tilt(log.motion.base_orientation).max())),
        "planning_s": None if plan is None else plan.planning_time}


PASS = Kind(
    "pass", "opens doors by a hit, walks through, and reports times, clearances and forces",
    draw, run, label=lambda row: str(row["group"]),
    summary=lambda rows: {"passed": count(rows, "passed")}, counts=("passed",),
    measures={"hit_to_clear_s": largest, "min_clearance_mm": smallest, "hand_force_n": largest,
              "leaf_angle_error_deg": largest, "margin_mm": smallest, "tilt_deg": largest,
              "contact_share": smallest, "after_release_n": largest, "planning_s": largest},
    worst="leaf_angle_error_deg",
    panels=(Panel("width", "hit_to_clear_s"), Panel("width", "min_clearance_mm", (0.0,)),
            Panel("width", "hand_force_n"), Panel("door_offset", "leaf_angle_error_deg"),
            Panel("friction", "margin_mm", (0.0,)), Panel("tau_scale", "hand_force_n")))
