"""Turns what a demonstration received and logged into its results: summary, pictures, report."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.files import write_whole
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config

from door_impact_evaluation.demo import drawing
from door_impact_evaluation.demo.received import Received
from door_impact_evaluation.demo.summary import summarize
from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.report import report, table
from door_impact_evaluation.report.run_replay import replay_of_run
from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.record import DemoRecord, Support


def write(received: Received, out: Path) -> None:
    """Writes the pictures, the report and at last summary.json, and prints the table.

    Args:
        received: What the demonstration received from the nodes.
        out: Folder of the results, in which the simulation has written simulation.npz.

    Raises:
        DemoError: The motion never began, or the robot never touched the door.
    """
    if not received.phases:
        raise DemoError(f"the motion never began: {received.outcome.message}")
    log = simulation_log.load(out / "simulation.npz", received.phases[0][0])
    hit = evaluation.impact(log.motion, received.plan.l_b)
    robot, door = load_robot_config(), load_door(received.door)
    measured = evaluation.support(log.motion, robot, window=evaluation.WINDOW)
    record = _record(received, log, hit, measured)
    drawing.draw_door(received.parameters, received.samples, door, out)
    drawing.draw_motion(record, received.target_deg, out)
    drawing.draw_animation(log, robot, door, record.contact_time, out / "impact.gif")
    raw = evaluation.support(log.motion, robot, window=0.0)
    summary = summarize(received, log, hit, record, raw)
    caught_deg = float(np.degrees(log.motion.door_angle[hit.peak:].min()))
    rows = table.rows(summary, caught_deg)
    heading = _heading(summary, received.outcome)
    notes = [*received.plan.warnings, *received.parameters.warnings]
    notes += [log.fell] if log.fell else []
    replay = replay_of_run(record, log, received.plan, robot, door)
    report.write(rows, heading, notes, replay, out / "report.html")
    write_whole(out / "summary.json", json.dumps(summary, indent=2) + "\n")
    print(table.text(rows), flush=True)
    print(heading, flush=True)


def _heading(summary: dict[str, Any], outcome: Any) -> str:
    """One sentence that says how far the door opened and what became of the robot."""
    door, robot = summary["door"], summary["robot"]
    opened = (f"HRP-2 opened the door to {door['peak_deg']:.1f} deg "
              f"({door['error_deg']:+.1f} deg from the desired {door['target_deg']:g} deg) and ")
    if robot["fell"]:
        return opened + "fell."
    if not outcome.success:
        return opened + f"stands, but {outcome.message}."
    if door["held_deg"] is None:
        return opened + "stands, back from the door."
    return opened + f"stands, holding it at {door['held_deg']:.1f} deg."


def _record(received: Received, log: simulation_log.SimulationLog, hit: evaluation.Impact,
            support: Support) -> DemoRecord:
    t = log.motion.t
    return DemoRecord(
        motion=log.motion,
        phases=_phases(received, log, hit),
        contact_time=float(t[hit.contact.start]),
        peak_time=float(t[hit.peak]),
        support=support,
        zmp_topic_t=received.zmp[:, 0],
        zmp_topic=received.zmp[:, 1:],
        door_topic_t=received.door_angle[:, 0],
        door_topic=received.door_angle[:, 1],
    )


def _phases(received: Received, log: simulation_log.SimulationLog, hit: evaluation.Impact,
            ) -> dict[str, tuple[float, float]]:
    """Start and end of each phase [s].

    The action's feedback gives the starts. Only the contact and the peak of the door are taken
    from the simulation's log, which has them to the millisecond.
    """
    t = log.motion.t
    contact, peak = float(t[hit.contact.start]), float(t[hit.peak])
    after = ("post", received.plan.ending)
    starts = [(time, name) for time, name in received.phases if name not in after]
    starts += [(contact, after[0]), (peak, after[1])]
    ends = [time for time, _ in starts[1:]] + [min(received.end, float(t[-1]))]
    return {name: (time, end) for (time, name), end in zip(starts, ends, strict=True)}
