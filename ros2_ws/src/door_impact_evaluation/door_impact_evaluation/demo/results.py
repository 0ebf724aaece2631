"""Write the results of a demonstration, summary, pictures and report, from messages and the log."""

import json
import math
import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
from door_impact_common.arrays import Array
from door_impact_common.files import write_whole
from door_model.door.config import DoorConfig, load_door
from door_model.door.door import Door
from door_model.motion.dynamics import simulate
from door_model.recording.recording import Recording
from door_model.recording.sample_store import SampleStore
from door_model.recording.swings import FreeSwing, find_swings
from door_model.ros.messages import to_batch
from humanoid_motion.robot_model import RobotModel
from impact_planner.ros.messages import door_from_message
from rclpy.utilities import get_rmw_implementation_identifier
from scipy.optimize import least_squares

from door_impact_evaluation.demo.settings import STANDS
from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.report import animation, figures, report, table
from door_impact_evaluation.report.replay import replay_of
from door_impact_evaluation.report.run_replay import run_of_log
from door_impact_evaluation.run import evaluation, passage_measures, simulation_log
from door_impact_evaluation.run.body_distances import body_distances
from door_impact_evaluation.run.record import DemoRecord, Motion, Support
from door_impact_evaluation.run.simulation_log import HitLoads, SimulationLog

_HELD_OVER = 0.3  # time at the end over which the held angle is averaged [s]
_IDENTIFIED = ("i_a", "c_c", "k_c", "tau_c0_prime")
_PLANNED = ("omega_door", "v_rb", "v_rb_post", "effective_mass", "effective_mass_planar", "a_r",
            "b_r", "i_rob", "l_b")  # numbers of the message ImpactPlan that the summary repeats
_PACKAGES = ("numpy", "scipy")  # packages whose versions are recorded


@dataclass(frozen=True)
class Received:
    """Messages, answers and times that the demonstration received, as any user of the nodes can.

    Attributes:
        door: Name or YAML file of the simulated door.
        target_deg: Desired opening angle [deg].
        parameters: Message CloserParameters with the identified door.
        plan: Message ImpactPlan with the plan that was executed; None if the door was pushed.
        outcome: Result of the action ExecuteDoorImpact, or of WalkThroughDoor.
        planning_ms: Wall time from the request to the answer of the planning service [ms].
        real_time_factor: Simulated time over wall time.
        wall_s: Wall time of the demonstration [s].
        door_angle: Stamp and angle of every message on /door_angle (n, 2) [s, rad].
        zmp: Stamp, x and y of every message on /zmp, in odom (m, 3) [s, m, m].
        samples: Messages EncoderSamples of the pushes by hand.
        phases: Start [s] and name of each phase, by the action's feedback.
        end: Time at which the motion had ended [s].
        passes: Whether the robot was to walk through the door.
    """

    door: str
    target_deg: float
    parameters: Any
    plan: Any
    outcome: Any
    planning_ms: float
    real_time_factor: float
    wall_s: float
    door_angle: Array
    zmp: Array
    samples: Sequence[Any]
    phases: list[tuple[float, str]]
    end: float
    passes: bool


def summarize(received: Received, log: SimulationLog, hit: evaluation.Impact | None,
              record: DemoRecord, raw: Support) -> dict[str, Any]:
    """Compute every figure of summary.json; those of the hit are None if the door was pushed.

    Args:
        received: What the demonstration received from the nodes.
        log: The simulation's log.
        hit: The first contact of robot and door in this log.
        record: What was measured of the motion.
        raw: ZMP and margins of the 1 kHz wrenches without averaging.
    """
    motion, loads = log.motion, None if hit is None else log.hit_loads(hit)
    return {
        **(dict.fromkeys(("door", "plan", "impact")) if hit is None or loads is None else
           _of_the_hit(received, motion, hit, loads, record)),
        "identified": _identified(received),
        "zmp": {
            "planned_min_margin_mm": None if hit is None else {
                m.phase: 1e3 * m.margin for m in received.plan.zmp_margins},
            "measured_min_margin_mm": _margins_mm(record.support, record),
            "raw_min_margin_mm": _margins_mm(raw, record),
        },
        "robot": {
            "name": log.robot.name,
            "fell": bool(log.fell),
            "max_tilt_deg": float(np.degrees(evaluation.tilt(motion.base_orientation).max())),
            "max_tracking_error_deg": float(np.degrees(log.max_tracking_error)),
            "max_torque_ratio": log.max_torque_ratio,
            "gear_load": loads and loads.shares,
            "foot_slip_mm": None if hit is None else 1e3 * evaluation.slip(
                motion, *record.phases["post"]),
        },
        "passage": passage_figures(received.outcome, received.door, log, record)
        if received.passes else None,
        "run": {
            "real_time_factor": received.real_time_factor,
            "wall_s": received.wall_s,
            "engine": log.engine,
            "rclpy": "pypi" if _version("ros-jazzy-rclpy") else "ros2",
            "rmw": get_rmw_implementation_identifier(),
            "versions": _versions(log.engine),
        },
    }


def _of_the_hit(received: Received, motion: Motion, hit: evaluation.Impact, loads: HitLoads,
                record: DemoRecord) -> dict[str, Any]:
    plan = received.plan
    ending = plan.phases[-1].name
    peak_deg = float(np.degrees(motion.door_angle[hit.peak]))
    end = record.phases[ending][1]
    last = (motion.t > end - _HELD_OVER) & (motion.t <= end)
    held = float(np.degrees(motion.door_angle[last].mean())) if ending == "hold" else None
    return {
        "door": {
            "target_deg": received.target_deg,
            "peak_deg": peak_deg,
            "error_deg": peak_deg - received.target_deg,
            "peak_time_s": record.peak_time - record.contact_time,
            "held_deg": held,
        },
        "plan": {
            **{key: float(getattr(plan, key)) for key in _PLANNED},
            "planning_ms": received.planning_ms,
        },
        "impact": {
            "v_rb_measured": hit.v_rb,
            "v_rb_post_measured": hit.v_rb_post,
            "omega_door_measured": hit.omega_door,
            "contacts_before_peak": hit.contacts_before_peak,
            "peak_force_n": hit.peak_force,
            "duration_ms": 1e3 * hit.duration,
            "restitution": hit.restitution,
            "switch_latency_ms": _switch_latency(received.outcome, record.contact_time),
            "brace_impulse_nms": loads.brace_impulse,
            "pad_force_n": loads.pad_force,
        },
    }


def passage_figures(
    outcome: Any, door: str, log: SimulationLog, record: DemoRecord,
) -> dict[str, Any]:
    """Compute "passage" of `summary.json`; None for figures that are not known.

    Args:
        outcome: Result of the action WalkThroughDoor.
        door: Name or YAML file of the simulated door.
        log: The simulation's log.
        record: What was measured of the motion.
    """
    robot, walk = RobotModel(log.robot), None
    plan, begin, t = outcome.plan, outcome.start_time, log.motion.t
    if math.isfinite(begin):
        walk = passage_measures.WalkedThrough(
            begin, begin + plan.release_time, outcome.steps,
            np.interp(t - begin, plan.times, plan.leaf_angle),
            body_distances(robot, log.motion, load_door(door),
                           (log.hinge_x, -log.door_distance), begin))
    first = min(begin for begin, _ in record.phases.values())
    found = passage_measures.summary(passage_measures.PassageRecord(
        log, record.support.margin, first, record.contact_time, record.peak_time, walk), robot)
    return {name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in found.items()}


def _identified(received: Received) -> dict[str, Any]:
    parameters, simulated = received.parameters, load_door(received.door)
    found: dict[str, Any] = {}
    for key in _IDENTIFIED:
        value, true = float(getattr(parameters, key)), float(getattr(simulated, key))
        found[key] = {"value": value, "std": float(getattr(parameters, f"{key}_std")), "true": true,
                      "relative_error": value / true - 1.0}
    found["fit_rmse_deg"] = float(np.degrees(parameters.fit_rmse))
    found["scale_reference"] = parameters.scale_reference
    return found


def _switch_latency(outcome: Any, contact_time: float) -> float | None:
    """Return the time from the contact to the switch of the motion [ms]; None if not known."""
    switch_latency = getattr(outcome, "switch_latency", math.nan)  # a passage does not tell it
    latency = 1e3 * (outcome.contact_time + switch_latency - contact_time)
    return latency if math.isfinite(latency) else None


def _margins_mm(support: Support, record: DemoRecord) -> dict[str, float]:
    """Return the smallest ZMP margin of each phase [mm]."""
    found = evaluation.smallest_margins(record.motion.t, support.margin, record.phases)
    return {name: 1e3 * value for name, value in found.items()}


def _version(package: str) -> str:
    """Return the version of a package of PyPI; empty if it is not installed as such."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def _versions(engine: str) -> dict[str, str]:
    # The package of a physics engine has the engine's name. Pinocchio from apt has no metadata.
    versions = {"python": platform.python_version(), "pinocchio": pinocchio.__version__}
    if "ROS_DISTRO" in os.environ:
        versions["ros"] = os.environ["ROS_DISTRO"]
    found = {name: _version(name) for name in (*_PACKAGES, engine)}
    return versions | {name: version for name, version in found.items() if version}


def write(received: Received, out: Path) -> None:
    """Write the pictures, the report and at last summary.json, and print the table.

    Args:
        received: What the demonstration received from the nodes.
        out: Folder of the results, in which the simulation has written simulation.npz.

    Raises:
        DemoError: The motion never began, or the robot did not hit the door.
    """
    if not received.phases:
        raise DemoError(f"the motion never began: {received.outcome.message}")
    log = simulation_log.load(out / "simulation.npz", received.phases[0][0])
    robot, door = log.robot, load_door(received.door)
    measured = evaluation.support(log.motion, robot, window=evaluation.WINDOW)
    t, starts = log.motion.t, {name: time for time, name in received.phases}
    hit, contact, peak = None, math.nan, math.nan
    if received.plan is not None:
        if "cam" not in starts:
            raise DemoError(f"the robot did not hit the door: {received.outcome.message}")
        hit = evaluation.impact(log.motion, received.plan.l_b, starts["cam"])
        contact, peak = float(t[hit.contact.start]), float(t[hit.peak])
    record = DemoRecord(
        motion=log.motion, phases=_phases(received, log, contact, peak), support=measured,
        contact_time=contact, peak_time=peak, zmp_topic=received.zmp,
        door_topic=received.door_angle)
    draw_door(received.parameters, received.samples, door, out)
    raw = evaluation.support(log.motion, robot, window=0.0)
    summary = summarize(received, log, hit, record, raw)
    true, shown = log, record
    if door.hinge == "left":  # pictures show the robot itself
        true = log.reflected()
        shown = replace(record, motion=true.motion, support=measured.reflected())
    notes = [*received.parameters.warnings, *([log.fell] if log.fell else [])]
    if hit is None:
        rows, notes = table.push_rows(summary), [received.outcome.plan.opening_reason, *notes]
    else:
        _draw_hit(received, record, true, summary, out)
        _, held_until = record.phases[received.plan.phases[-1].name]
        falls = (t >= peak) & (t <= held_until)
        rows = table.rows(summary, float(np.degrees(log.motion.door_angle[falls].min())))
        notes = [*received.plan.warnings, *notes]
    heading = _heading(robot.name, summary, received.outcome)
    replay = replay_of(run_of_log(shown, true, received.plan, door))
    report.write(rows, heading, notes, replay, out / "report.html")
    write_whole(out / "summary.json", json.dumps(summary, indent=2) + "\n")
    print(table.text(rows), flush=True)
    print(heading, flush=True)


def _draw_hit(received: Received, record: DemoRecord, true: SimulationLog,
              summary: dict[str, Any], out: Path) -> None:
    """Draw the pictures of a hit; arguments as of `write` and `summarize`."""
    figures.cam(out / "cam_curve.png")
    figures.zmp(record, out / "zmp.png")
    figures.door_angle(record, received.target_deg, out / "door_angle.png")
    since = summary["passage"] and summary["passage"]["hit_to_clear_s"]
    whole = {"after": since + STANDS, "slow_motion": 1.0, "follow": True} if since else {}
    animation.hit(true, load_door(received.door), record.contact_time, out / "impact.gif", **whole)


def _heading(name: str, summary: dict[str, Any], outcome: Any) -> str:
    """Return a sentence about how far the door opened and what became of the robot of a name."""
    door, robot, through = summary["door"], summary["robot"], summary["passage"]
    opened = f"{name} pushed the door and " if door is None else (
        f"{name} did not open the door and " if door["peak_deg"] <= table.OPENED else
        f"{name} opened the door to {door['peak_deg']:.1f} deg "
        f"({door['error_deg']:+.1f} deg from the desired {door['target_deg']:g} deg) and ")
    if robot["fell"]:
        return opened + "fell."
    if not outcome.success:
        return opened + f"stands, but {outcome.message}."
    if through is not None:
        since = ("hit_to_clear_s", "the hit") if door else ("time_s", "its first motion")
        return opened + (
            f"stands beyond it, clear of it {through[since[0]]:.1f} s after {since[1]}."
            if through["passed"] else "stands, but has not passed it.")
    if door["held_deg"] is None:
        return opened + "stands, back from the door."
    return opened + f"stands, holding it at {door['held_deg']:.1f} deg."


def _phases(received: Received, log: SimulationLog, contact: float, peak: float,
            ) -> dict[str, tuple[float, float]]:
    """Return start and end of each phase [s].

    The action's feedback gives the starts. Only the contact and the peak of the door are taken
    from the simulation's log, which has them to the millisecond.
    """
    starts = received.phases
    if received.plan is not None:
        after = ("post", received.plan.phases[-1].name)
        starts = [(time, name) for time, name in starts if name not in after]
        starts = sorted([*starts, (contact, after[0]), (peak, after[1])])
    ends = [time for time, _ in starts[1:]] + [min(received.end, float(log.motion.t[-1]))]
    return {name: (time, end) for (time, name), end in zip(starts, ends, strict=True)}


def draw_door(parameters: Any, samples: Sequence[Any], simulated: DoorConfig, out: Path) -> None:
    """Draw the identified door: its closer's angle, its restoring torque and its swings.

    Args:
        parameters: Message CloserParameters with the identified door.
        samples: Messages EncoderSamples of the pushes by hand.
        simulated: The door that the simulation moves, for comparison.
        out: Folder of the pictures.

    Raises:
        NoDoor: The message describes no door.
    """
    identified = door_from_message(parameters).door
    swings = [_swing_fit(identified, swing.opening()) for swing in find_swings(_recording(samples))]
    swung_to = max(float(measured.max()) for _, measured, _ in swings)
    figures.closer_angle(identified.closer, out / "closer_angle.png")
    figures.restoring_torque(identified, simulated.door(), swung_to, out / "restoring_torque.png")
    figures.identification_fit(swings, float(np.degrees(parameters.fit_rmse)),
                               out / "identification.png")


def _recording(samples: Sequence[Any]) -> Recording:
    """Return the encoder's samples as one recording, whose times begin at 0."""
    store = SampleStore()
    for message in samples:
        store.add(to_batch(message))
    return store.recording()


def _swing_fit(door: Door, swing: FreeSwing) -> tuple[Array, Array, Array]:
    """Return an opening swing as it was measured, and by eq. (1) with the parameters of `door`.

    Initial angle and angular velocity are no parameters of the door: they are fitted anew to each
    swing.
    """
    t = swing.t - swing.t[0]

    def theta(start: Array) -> Array:
        motion = simulate(door, start[0], start[1], float(t[-1]) + 1e-3)
        return np.interp(t, motion.t, motion.theta)

    best = least_squares(lambda start: theta(start) - swing.theta,
                         [swing.theta[0], swing.start_speed], x_scale=[0.1, 1.0]).x
    return swing.t, swing.theta, theta(best)
