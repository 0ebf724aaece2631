"""The figures of a demonstration, as they are written to summary.json.

Units are SI units; degrees, millimetres and milliseconds only where the key ends in their names.
"""

import math
import os
import platform
from importlib import metadata
from typing import Any

import numpy as np
import pinocchio
from door_model.door.config import load_door
from rclpy.utilities import get_rmw_implementation_identifier

from door_impact_evaluation.demo.received import Received
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.record import DemoRecord, Support
from door_impact_evaluation.run.simulation_log import HitLoads, SimulationLog

_HELD_OVER = 0.3  # time at the end over which the held angle is averaged [s]
_IDENTIFIED = ("i_a", "c_c", "k_c", "tau_c0_prime")
_PLANNED = ("omega_door", "v_rb", "v_rb_post", "effective_mass", "effective_mass_planar", "a_r",
            "b_r", "i_rob", "l_b")  # numbers of the message ImpactPlan that the summary repeats
_PACKAGES = ("numpy", "scipy")  # packages whose versions are recorded


def summarize(received: Received, log: SimulationLog, hit: evaluation.Impact, record: DemoRecord,
              raw: Support) -> dict[str, Any]:
    """Computes every figure of summary.json.

    Args:
        received: What the demonstration received from the nodes.
        log: The simulation's log.
        hit: The first contact of robot and door in this log.
        record: What was measured of the motion.
        raw: ZMP and margins of the 1 kHz wrenches without averaging.
    """
    plan, loads = received.plan, log.hit_loads(hit)
    return {
        "door": _door(received, log, hit, record),
        "identified": _identified(received),
        "plan": {
            **{key: float(getattr(plan, key)) for key in _PLANNED},
            "planning_ms": received.planning_ms,
        },
        "impact": _impact(received, loads, hit, record),
        "zmp": {
            "planned_min_margin_mm": {m.phase: 1e3 * m.margin for m in plan.zmp_margins},
            "measured_min_margin_mm": _margins_mm(record.support, record),
            "raw_min_margin_mm": _margins_mm(raw, record),
        },
        "robot": _robot(log, loads, record),
        "run": {
            "real_time_factor": received.real_time_factor,
            "wall_s": received.wall_s,
            "engine": log.engine,
            "rclpy": _rclpy(),
            "rmw": get_rmw_implementation_identifier(),
            "versions": _versions(log.engine),
        },
    }


def _door(received: Received, log: SimulationLog, hit: evaluation.Impact,
          record: DemoRecord) -> dict[str, Any]:
    motion, ending = log.motion, received.plan.ending
    peak_deg = float(np.degrees(motion.door_angle[hit.peak]))
    end = record.phases[ending][1]
    last = (motion.t > end - _HELD_OVER) & (motion.t <= end)
    held = float(np.degrees(motion.door_angle[last].mean())) if ending == "hold" else None
    return {
        "target_deg": received.target_deg,
        "peak_deg": peak_deg,
        "error_deg": peak_deg - received.target_deg,
        "peak_time_s": record.peak_time - record.contact_time,
        "held_deg": held,
    }


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


def _impact(received: Received, loads: HitLoads, hit: evaluation.Impact,
            record: DemoRecord) -> dict[str, Any]:
    return {
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
    }


def _switch_latency(outcome: Any, contact_time: float) -> float | None:
    """Time from the contact to the switch to the motion after the hit [ms].

    Returns:
        None where the executor did not switch.
    """
    latency = 1e3 * (outcome.contact_time + outcome.switch_latency - contact_time)
    return latency if math.isfinite(latency) else None


def _margins_mm(support: Support, record: DemoRecord) -> dict[str, float]:
    """Smallest ZMP margin of each phase [mm]."""
    found = evaluation.smallest_margins(record.motion.t, support.margin, record.phases)
    return {name: 1e3 * value for name, value in found.items()}


def _robot(log: SimulationLog, loads: HitLoads, record: DemoRecord) -> dict[str, Any]:
    tilt = evaluation.tilt(log.motion.base_orientation)
    return {
        "fell": bool(log.fell),
        "max_tilt_deg": float(np.degrees(tilt.max())),
        "max_tracking_error_deg": float(np.degrees(log.max_tracking_error)),
        "max_torque_ratio": log.max_torque_ratio,
        "gear_load": loads.shares,
        "foot_slip_mm": 1e3 * evaluation.slip(log.motion, *record.phases["post"]),
    }


def _rclpy() -> str:
    """Names where rclpy is from: "pypi" for the wheels of PyPI, "ros2" for an installed ROS 2."""
    try:
        metadata.version("ros-jazzy-rclpy")
    except metadata.PackageNotFoundError:
        return "ros2"
    return "pypi"


def _versions(engine: str) -> dict[str, str]:
    # The package of a physics engine has the engine's name. Pinocchio from apt has no metadata.
    versions = {"python": platform.python_version(), "pinocchio": pinocchio.__version__}
    if "ROS_DISTRO" in os.environ:
        versions["ros"] = os.environ["ROS_DISTRO"]
    for name in (*_PACKAGES, engine):
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions
