"""From what was heard and logged to out/demo: summary.json, table, figures, animation, report."""

import importlib.util
import json
import math
import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import rclpy
from door_impact_common.arrays import Array
from door_model.door.closer import FourBarCloser
from door_model.door.config import load_door
from door_model.door.door import Door
from door_model.motion.dynamics import simulate
from door_model.recording.recording import Recording
from door_model.recording.swings import FreeSwing, find_swings
from hrp2_description.robot import RobotConfig, load_robot_config
from rclpy.utilities import get_rmw_implementation_identifier
from scipy.optimize import least_squares

from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.report import animation, figures, report, table
from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.record import DemoRecord, SwingFit

HELD_OVER = 0.3  # [s] at the end, over which the held angle is averaged
IDENTIFIED = ("i_a", "c_c", "k_c", "tau_c0_prime")


@dataclass(frozen=True)
class Heard:
    """What the demonstration heard from the nodes, as a user would.

    Attributes:
        door: Name or YAML file of the simulated door.
        target_deg: Desired opening angle [deg].
        parameters: CloserParameters.
        plan: ImpactPlan.
        outcome: Result of the action.
        planning_ms: Time of the planning service [ms].
        real_time_factor: Simulated over wall time.
        wall_s: Wall time of the demonstration [s].
        door_angle: Stamp and angle heard on /door_angle (n, 2) [s, rad].
        zmp: Stamp, x and y heard on /zmp (m, 3) [s, m, m].
        samples: EncoderSamples of the pushes.
        phases: Start [s] and name of each phase, from the action's feedback.
        end: When the motion had ended [s].
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


def write(heard: Heard, out: Path) -> None:
    """Writes everything and prints the table.

    Args:
        heard: What was heard.
        out: Folder; it must hold simulation.npz.

    Raises:
        DemoError: The robot never touched the door.
    """
    if not heard.phases:
        raise DemoError(f"the motion never began: {heard.outcome.message}")
    log = simulation_log.load(out / "simulation.npz", heard.phases[0][0])
    hit = evaluation.impact(log.motion, heard.plan.l_b)
    robot = load_robot_config()
    support = evaluation.support(log.motion, robot, window=evaluation.WINDOW)
    raw = evaluation.support(log.motion, robot, window=0.0)
    record = _record(heard, log, hit, support)
    summary = _summary(heard, log, hit, record, {"measured": support, "raw": raw})
    _figures(heard, log, robot, record, summary, out)
    partial = out / "summary.json.part"
    partial.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    partial.replace(out / "summary.json")
    caught_deg = float(np.degrees(log.motion.door_angle[hit.peak:].min()))
    lines = table.rows(summary, caught_deg)
    notes = [*heard.plan.warnings, *heard.parameters.warnings, *([log.fell] if log.fell else [])]
    report.write(lines, _heading(summary, heard.outcome), notes, out / "report.html")
    print(table.text(lines), flush=True)
    print(_heading(summary, heard.outcome))
    print(f"See {out / 'report.html'} for the figures and the animation.", flush=True)


def _heading(summary: dict[str, Any], outcome: Any) -> str:
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


def _phases(heard: Heard, log: simulation_log.SimulationLog, hit: evaluation.Impact,
            ) -> dict[str, tuple[float, float]]:
    """Times of the phases; the hit and the peak are the simulation's, to the millisecond."""
    t = log.motion.t
    contact, peak = float(t[hit.contact.start]), float(t[hit.peak])
    after = ("post", heard.plan.ending)
    starts = [(time, name) for time, name in heard.phases if name not in after]
    starts += [(contact, after[0]), (peak, after[1])]
    ends = [time for time, _ in starts[1:]] + [min(heard.end, float(t[-1]))]
    return {name: (time, end) for (time, name), end in zip(starts, ends, strict=True)}


def _record(heard: Heard, log: simulation_log.SimulationLog, hit: evaluation.Impact,
            support: evaluation.Support) -> DemoRecord:
    t = log.motion.t
    return DemoRecord(
        motion=log.motion,
        phases=_phases(heard, log, hit),
        contact_time=float(t[hit.contact.start]),
        peak_time=float(t[hit.peak]),
        zmp_t=t,
        zmp_measured=support.zmp,
        polygon_low=support.low,
        polygon_high=support.high,
        zmp_topic_t=heard.zmp[:, 0],
        zmp_topic=heard.zmp[:, 1:],
        door_topic_t=heard.door_angle[:, 0],
        door_topic=heard.door_angle[:, 1],
    )


def _summary(heard: Heard, log: simulation_log.SimulationLog, hit: evaluation.Impact,
             record: DemoRecord, supports: dict[str, evaluation.Support]) -> dict[str, Any]:
    motion, plan = log.motion, heard.plan
    peak_deg = float(np.degrees(motion.door_angle[hit.peak]))
    end = record.phases[plan.ending][1]
    last = (motion.t > end - HELD_OVER) & (motion.t <= end)
    held = plan.ending == "hold"

    def margins(of: str) -> dict[str, float]:
        found = evaluation.smallest_margins(motion.t, supports[of].margin, record.phases)
        return {name: 1e3 * value for name, value in found.items()}

    return {
        "door": {
            "target_deg": heard.target_deg,
            "peak_deg": peak_deg,
            "error_deg": peak_deg - heard.target_deg,
            "peak_time_s": record.peak_time - record.contact_time,
            "held_deg": float(np.degrees(motion.door_angle[last].mean())) if held else None,
        },
        "identified": _identified(heard),
        "plan": {
            **{key: float(getattr(plan, key)) for key in (
                "omega_door", "v_rb", "v_rb_post", "effective_mass", "effective_mass_planar", "a_r",
                "b_r", "i_rob", "l_b")},
            "planning_ms": heard.planning_ms,
        },
        "impact": {
            "v_rb_measured": hit.v_rb,
            "v_rb_post_measured": hit.v_rb_post,
            "omega_door_measured": hit.omega_door,
            "contacts_before_peak": hit.contacts_before_peak,
            "peak_force_n": hit.peak_force,
            "duration_ms": 1e3 * hit.duration,
            "restitution": hit.restitution,
            "switch_latency_ms": _switch_latency(heard.outcome, record.contact_time),
            "brace_impulse_nms": log.brace_impulse,
            "braced_joints": {
                name: {"carried_nms": joint.carried, "motor_could_nms": joint.motor}
                for name, joint in log.braced_joints.items()
            },
        },
        "zmp": {
            "planned_min_margin_mm": {m.phase: 1e3 * m.margin for m in plan.zmp_margins},
            "measured_min_margin_mm": margins("measured"),
            "raw_min_margin_mm": margins("raw"),
        },
        "robot": {
            "fell": bool(log.fell),
            "max_tilt_deg": float(np.degrees(evaluation.tilt(motion.base_orientation).max())),
            "max_tracking_error_deg": float(np.degrees(log.max_tracking_error)),
            "max_torque_ratio": log.max_torque_ratio,
            "foot_slip_mm": 1e3 * evaluation.slip(motion, *record.phases["post"]),
        },
        "run": {
            "real_time_factor": heard.real_time_factor,
            "wall_s": heard.wall_s,
            "runtime": runtime(),
            "rmw": get_rmw_implementation_identifier(),
            "versions": _versions(),
        },
    }


def _identified(heard: Heard) -> dict[str, Any]:
    parameters, truth = heard.parameters, load_door(heard.door)
    found: dict[str, Any] = {}
    for key in IDENTIFIED:
        value, true = float(getattr(parameters, key)), float(getattr(truth, key))
        found[key] = {"value": value, "std": float(getattr(parameters, f"{key}_std")), "true": true,
                      "relative_error": value / true - 1.0}
    found["fit_rmse_deg"] = float(np.degrees(parameters.fit_rmse))
    found["scale_reference"] = parameters.scale_reference
    return found


def runtime() -> str:
    """Which rclpy runs: "embedded" where it is this project's drop-in, else "ros2"."""
    own = importlib.util.find_spec("ros2_embedded")
    if own is None or own.origin is None:
        return "ros2"
    return "embedded" if Path(rclpy.__file__).parents[1] == Path(own.origin).parents[1] else "ros2"


def _versions() -> dict[str, str]:
    # Pinocchio from apt has no Python metadata.
    versions = {"python": platform.python_version(), "pinocchio": pinocchio.__version__}
    if "ROS_DISTRO" in os.environ:
        versions["ros"] = os.environ["ROS_DISTRO"]
    for name in ("numpy", "scipy", "pybullet", "cyclonedds"):
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


def _identified_door(parameters: Any) -> Door:
    closer = FourBarCloser(parameters.link_l, parameters.link_l1, parameters.link_l2,
                           parameters.link_l3, parameters.theta_i0)
    return Door(parameters.i_a, parameters.c_c, parameters.k_c, parameters.tau_c0_prime, closer)


def _swings(heard: Heard, door: Door) -> list[SwingFit]:
    """The opening doors as the encoder saw them, and eq. (1) with the identified parameters.

    Initial angle and angular velocity are not parameters of the door: each swing has its own.
    """
    return [_swing_fit(door, swing.opening()) for swing in find_swings(_recording(heard.samples))]


def _swing_fit(door: Door, swing: FreeSwing) -> SwingFit:
    t = swing.t - swing.t[0]

    def theta(start: Array) -> Array:
        motion = simulate(door, start[0], start[1], float(t[-1]) + 1e-3)
        return np.interp(t, motion.t, motion.theta)

    best = least_squares(lambda start: theta(start) - swing.theta,
                         [swing.theta[0], swing.start_speed], x_scale=[0.1, 1.0]).x
    return SwingFit(t=swing.t, measured=swing.theta, fitted=theta(best))


def _recording(samples: Sequence[Any]) -> Recording:
    """The encoder's samples as one recording."""
    t, theta = [], []
    for batch in samples:
        stamp = batch.header.stamp
        counts = np.array(batch.counts, dtype=float)
        t.append(stamp.sec + 1e-9 * stamp.nanosec + batch.period * np.arange(len(counts)))
        theta.append(2.0 * np.pi / batch.counts_per_turn * counts)
    return Recording(np.concatenate(t), np.concatenate(theta),
                     2.0 * np.pi / samples[0].counts_per_turn)


def _switch_latency(outcome: Any, contact_time: float) -> float | None:
    """From the contact to the switch to the motion after the hit [ms]; None: there was none."""
    latency = 1e3 * (outcome.contact_time + outcome.switch_latency - contact_time)
    return latency if math.isfinite(latency) else None


def _figures(heard: Heard, log: simulation_log.SimulationLog, robot: RobotConfig,
             record: DemoRecord, summary: dict[str, Any], out: Path) -> None:
    identified, config = _identified_door(heard.parameters), load_door(heard.door)
    swings = _swings(heard, identified)
    swung_to = max(float(swing.measured.max()) for swing in swings)
    figures.closer_angle(identified.closer, out / "closer_angle.png")
    figures.restoring_torque(identified, config.door(), swung_to, out / "restoring_torque.png")
    figures.identification_fit(swings, summary["identified"]["fit_rmse_deg"],
                               out / "identification.png")
    figures.cam(out / "cam_curve.png")
    figures.zmp(record, out / "zmp.png")
    figures.door_angle(record, heard.target_deg, out / "door_angle.png")
    motion = log.motion
    scene = animation.Scene(
        urdf=str(robot.urdf_path), joint_names=robot.joint_names,
        leaf=(config.leaf.width, config.leaf.height, config.leaf.thickness),
        hinge_x=log.hinge_x, door_distance=log.door_distance)
    poses = animation.Poses(t=motion.t, joints=motion.joints, base_position=motion.base_position,
                            base_orientation=motion.base_orientation, door_angle=motion.door_angle)
    animation.hit(scene, poses, record.contact_time, out / "impact.gif")
