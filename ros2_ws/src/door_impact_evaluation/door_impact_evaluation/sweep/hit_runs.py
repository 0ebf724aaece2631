"""Hits of a sweep's cases, and what is measured in them."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.errors import SimBridgeError
from hrp2_sim_bridge.settings import WorldSettings

from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from door_impact_evaluation.sweep.hit_cases import HitCase
from door_impact_evaluation.sweep.numbers import smallness

UPRIGHT = np.radians(5.0)  # tilt at the end below which the robot counts as standing [rad]
HELD_OVER = 0.5            # time at the end over which the held angle is averaged [s]


def run_case(case: HitCase, engine: str = WorldSettings.engine) -> list[dict[str, Any]]:
    """Runs the hits of a case.

    Args:
        case: The case.
        engine: Physics engine of the simulation.

    Returns:
        One record for each hit. A refused plan or a miss is the last.
    """
    records: list[dict[str, Any]] = []
    for run in hits(case, engine):
        record: dict[str, Any] = {"name": case.name, "hit": len(records), "case": case.as_json()}
        records.append(record | (
            measured(run) if isinstance(run, Rehearsal) else {"refused": str(run)}))
    return records


def hits(
    case: HitCase, engine: str = WorldSettings.engine
) -> Iterator[Rehearsal | DoorImpactError]:
    """Runs the hits of a case, one after the other.

    Args:
        case: The case.
        engine: Physics engine of the simulation.

    Yields:
        Each hit; the last one may be the error of a refused plan, or a miss.
    """
    known = case.known()
    with tempfile.TemporaryDirectory() as folder:
        for hit in range(case.hits):
            try:
                run = rehearse(
                    case.target_deg, Path(folder) / "log.npz", door=case.config(), known=known,
                    door_offset=case.door_offset, run_up=case.run_up, engine=engine,
                    **case.world(hit))
            except SimBridgeError:  # no refusal of the planner, and no result
                raise
            except DoorImpactError as error:
                yield error
                return
            yield run
            if run.impact is None:
                return
            known = replace(known, experience=run.learned())


def measured(run: Rehearsal) -> dict[str, Any]:
    """Evaluates a run by the simulation's log.

    Args:
        run: The run.

    Returns:
        Figures of the run in SI units; angles in degrees, lengths in millimetres and times in
        milliseconds where the key says so.
    """
    plan, motion, execution = run.plan, run.log.motion, run.execution
    found: dict[str, Any] = {
        "outcome": execution.outcome.value,
        "stood": not run.log.fell and bool(
            evaluation.tilt(motion.base_orientation[-1:])[0] < UPRIGHT),
        "planned": {"v_rb": plan.v_rb, "omega_door": plan.omega_door,
                    "effective_mass": plan.effective_mass, "restitution": plan.restitution,
                    "impulse": plan.required_impulse, "learned_hits": plan.learned_hits},
    }
    if run.impact is None:
        return found
    hit, t = run.impact, motion.t
    contact = t[hit.contact.start]
    margin = evaluation.support(motion, load_robot_config(), window=evaluation.WINDOW).margin
    pushed = evaluation.centred_mean(motion.contact_force[hit.peak:, None], 20)
    opened = float(np.degrees(motion.door_angle[hit.peak]))
    by_robot = execution.measured
    return found | {
        "peak_deg": opened,
        "error_deg": opened - float(np.degrees(plan.desired_opening_angle)),
        "held_deg": float(np.degrees(motion.door_angle[t > t[-1] - HELD_OVER].mean())),
        "margin_mm": {name: 1e3 * value for name, value in
                      evaluation.smallest_margins(t, margin, run.phases()).items()},
        "contacts": hit.contacts_before_peak,
        "v_rb": hit.v_rb,
        "omega_door": hit.omega_door,
        "momentum_ratio": plan.effective_mass * (hit.v_rb - hit.v_rb_post) * plan.l_b / (
            run.known.door.i_a * hit.omega_door),
        "slip_mm": 1e3 * evaluation.slip(motion, contact, contact + 0.1),
        "hand_force_n": float(pushed.max()),
        "switch_latency_ms": float(
            1e3 * (by_robot.contact_time + by_robot.switch_latency - contact)),
    }


def by_error(record: dict[str, Any]) -> float:
    """Returns a key that sorts records of hits by the size of their error, the largest first."""
    return smallness(record["error_deg"])
