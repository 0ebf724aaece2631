"""Kind ``hit``: hits on doors that differ from what the planner knows of them."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from door_model.door.config import DoorConfig, load_door
from door_model.identification.identify import identify
from door_model.identification.scale import scale_from_leaf
from door_model.recording.synthetic import synthetic_recording
from impact_planner.task.known_door import KnownDoor

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
    statistics,
)

DOOR_OFF = 0.02            # largest error of the surveyed distance of the door [m]
CLOSER = (0.9, 1.1)        # range of the factors of c_c, k_c and tau'_c0
FRICTION = (0.5, 1.0)      # range of the friction coefficient of the soles
PEAKS_DEG = (10.0, 32.0)   # range of the largest angles of the pushes by hand [deg]
PUSHES = 5                 # pushes by hand from which a door is identified
RANGES = {"perturbed": (0.03, (0.9, 1.1), (0.7, 1.3)), "rough": (0.1, (0.7, 1.4), (0.5, 2.0))}
"""Largest change of the restitution, factors of the rotors' inertia, of the gears and pads."""
NOMINAL = tuple(("paper", target, "mcv50") for target in (15.0, 20.0, 25.0, 30.0)) + tuple(
    (door, 25.0, "zmp_limited") for door in ("size2", "size3"))
"""Door, desired angle [deg] and run-up of each nominal case."""
CASE: Row = {  # a "scale" is a factor of the model's value; of gears and pads, their stiffness
    "hits": 1,            # each plan uses what the hits before have taught
    "seed": 0,            # later hits add their number
    "door": "paper", "target_deg": 25.0, "run_up": "mcv50",
    "door_offset": 0.0,   # distance by which the door stands farther away than surveyed [m]
    "c_c_scale": 1.0, "k_c_scale": 1.0, "tau_scale": 1.0,  # of c_c, k_c and tau'_c0
    "restitution": None,  # None: the configured coefficient
    "rotor_scale": 1.0, "friction": 0.8, "gear_scale": 1.0, "pad_scale": 1.0,
    "pushes_deg": [],     # swings from which the door is identified; none: it is known exactly
    "phase": 0.5,         # angle of the closed door within an encoder count
}
"""What is not drawn: the planner knows a door as it is configured, and nothing differs."""
HELD_OVER = 0.5            # time at the end over which the held angle is averaged [s]
_PHASE = "margin_mm_"      # before the name of a phase: column of its smallest ZMP margin


def draw(n: int, seed: int) -> list[Row]:
    """Draw n cases in each of the groups perturbed and rough, beside the nominal ones."""
    nominal = [CASE | {"group": "nominal", "index": index, "door": door, "target_deg": target,
                       "run_up": run_up, "hits": 2}
               for index, (door, target, run_up) in enumerate(NOMINAL)]
    return nominal + [_drawn(group, index, seed) for group in RANGES for index in range(n)]


def _drawn(group: str, index: int, seed: int) -> Row:
    hits = 1 + (group == "rough")
    random = np.random.default_rng([seed, index, hits - 1])
    off, rotors, stiffness = RANGES[group]

    def factor() -> float:  # its logarithm is uniformly distributed
        return float(np.exp(random.uniform(*np.log(stiffness))))

    # The order of the draws belongs to the seed: in another one, other cases would be drawn.
    noise, offset = int(random.integers(1 << 30)), float(random.uniform(-DOOR_OFF, DOOR_OFF))
    c_c, k_c, tau = random.uniform(*CLOSER, 3).tolist()
    return CASE | {
        "group": group, "index": index, "hits": hits, "seed": noise, "door_offset": offset,
        "c_c_scale": c_c, "k_c_scale": k_c, "tau_scale": tau,
        "restitution": load_door("paper").restitution + float(random.uniform(-off, off)),
        "rotor_scale": float(random.uniform(*rotors)),
        "friction": float(random.uniform(*FRICTION)),
        "pushes_deg": random.uniform(*PEAKS_DEG, PUSHES).tolist(),
        "phase": float(random.uniform()), "gear_scale": factor(), "pad_scale": factor()}


def simulated_door(case: Row) -> DoorConfig:
    """Return the door of a case as it is simulated."""
    plain = load_door(case["door"])
    return replace(plain, c_c=case["c_c_scale"] * plain.c_c, k_c=case["k_c_scale"] * plain.k_c,
                   tau_c0_prime=case["tau_scale"] * plain.tau_c0_prime)


def known_door(case: Row, config: DoorConfig) -> KnownDoor:
    """Return what the planner knows of a simulated door before the first hit, from its swings."""
    if not case["pushes_deg"]:
        return KnownDoor.configured(config)
    recording = synthetic_recording(
        config.door(), np.radians(case["pushes_deg"]).tolist(), phase=case["phase"])
    leaf = config.leaf
    found = identify(recording, config.linkage, scale_from_leaf(leaf.mass, leaf.width))
    return replace(KnownDoor.configured(config), door=found.door, parameters=found.names,
                   covariance=found.covariance)


def run(case: Row) -> Iterator[Row]:
    """Run the hits of a case, one after the other, and measure each; a miss is the last."""
    door = simulated_door(case)
    before = known_door(case, door)
    world = {name: case[name] for name in (
        "door_offset", "run_up", "engine", "restitution", "rotor_scale", "friction", "gear_scale",
        "pad_scale")}
    with tempfile.TemporaryDirectory() as folder:
        for hit in range(case["hits"]):
            found = rehearse(case["target_deg"], Path(folder) / "log.npz", door=door, known=before,
                             seed=case["seed"] + hit, robot=robot_of(case), **world)
            yield measured(found)
            if found.impact is None:
                return
            before = replace(before, experience=found.learned())


def measured(found: Rehearsal) -> Row:
    """Evaluate a hit by the simulation's log; SI units, but deg, mm, ms where the key says so."""
    plan, motion, by_robot = found.plan, found.log.motion, found.execution.measured
    row: Row = {
        "outcome": found.execution.outcome.value, "stood": found.log.stood, "fell": found.log.fell,
        "planned_v_rb": plan.v_rb, "planned_omega_door": plan.omega_door,
        "planned_effective_mass": plan.effective_mass, "planned_restitution": plan.restitution,
        "planned_impulse": plan.required_impulse, "learned_hits": plan.learned_hits}
    if found.impact is None:
        return row
    hit, t = found.impact, motion.t
    contact = t[hit.contact.start]
    margin = evaluation.support(motion, found.robot, window=evaluation.WINDOW).margin
    margins = {name: 1e3 * value for name, value in
               evaluation.smallest_margins(t, margin, found.phases()).items()}
    pushed = evaluation.centred_mean(motion.contact_force[hit.peak:, None], 20)
    opened = float(np.degrees(motion.door_angle[hit.peak]))
    return row | {
        "peak_deg": opened, "error_deg": opened - float(np.degrees(plan.desired_opening_angle)),
        "held_deg": float(np.degrees(motion.door_angle[t > t[-1] - HELD_OVER].mean())),
        "margin_mm": float(known(margins.values()).min(initial=np.inf)),
        **{_PHASE + name: value for name, value in margins.items()},
        "contacts": hit.contacts_before_peak, "v_rb": hit.v_rb, "omega_door": hit.omega_door,
        "momentum_ratio": plan.effective_mass * (hit.v_rb - hit.v_rb_post) * plan.l_b / (
            found.known.door.i_a * hit.omega_door),
        "slip_mm": 1e3 * evaluation.slip(motion, contact, contact + 0.1),
        "hand_force_n": float(pushed.max()),
        "switch_latency_ms": 1e3 * float(by_robot.contact_time + by_robot.switch_latency - contact)}


def summary(rows: list[Row]) -> Row:
    """Compute the figures; "stood" and "contacts_one" count first hits on perturbed doors."""
    def of(group: str, hit: int) -> list[Row]:
        return [row for row in rows if (row["group"], row["run"]) == (group, hit)]

    first = of("perturbed", 0)
    phases = dict.fromkeys(name for row in rows for name in row if name.startswith(_PHASE))
    return {
        "stood": count(first, "stood"),
        "contacts_one": sum(row.get("contacts") == 1 for row in first),
        **{key: statistics(row.get("error_deg") for row in group) for key, group in (
            ("error_deg", first), ("before_learning", of("rough", 0)),
            ("after_learning", of("rough", 1)))},
        "min_margin_mm": {name.removeprefix(_PHASE): smallest(row.get(name) for row in rows)
                          for name in phases}}


HIT = Kind(
    "hit", "hits perturbed doors and reports how far they opened", draw, run,
    label=lambda row: f"{row['group']}, hit {row['run'] + 1}",
    summary=summary, counts=(),
    measures={"error_deg": statistics, "margin_mm": smallest, "hand_force_n": largest},
    worst="error_deg",
    panels=(*(Panel(name, "error_deg", (0.0,)) for name in (
        "door_offset", "tau_scale", "restitution", "rotor_scale", "friction", "gear_scale",
        "pad_scale")), Panel("error_deg"), Panel("error_deg", "margin_mm", (0.0,)),
        Panel("error_deg", "switch_latency_ms")))
