"""A planned walk as text for people and as a JSON object for scripts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from humanoid_motion.robot_model import RobotModel

from walking.pattern.walk_plan import WalkPlan

_SHOWN_JOINTS = 3  # number of the fastest joints in the text


def plan_object(plan: WalkPlan, robot: RobotModel, planning_time: float) -> dict[str, Any]:
    """Return a walk as a JSON object.

    Args:
        plan: The walk.
        robot: Robot that the walk is for.
        planning_time: Time that planning took [s].
    """
    checks, goal = plan.checks, plan.stance.middle
    clearance = checks.clearance
    return {
        "planning_ms": 1e3 * planning_time,
        "duration": plan.duration,
        "goal": {"x": goal.x, "y": goal.y, "yaw_deg": math.degrees(goal.yaw)},
        "min_margin_mm": 1e3 * float(checks.margin.min()),
        "required_friction": checks.friction,
        "speed_ratio": _by_joint(robot, checks.speed_ratio),
        "torque_ratio": _by_joint(robot, checks.torque_ratio),
        "clearance": None if clearance is None or not clearance.bodies else {
            "bodies": list(clearance.bodies), "distance_mm": 1e3 * clearance.distance,
            "limit_mm": 1e3 * clearance.limit},
        "footsteps": [
            {"side": step.side, "x": step.x, "y": step.y, "yaw_deg": math.degrees(step.yaw),
             "begin": plan.begin_of(index), "touchdown": plan.touchdown_of(index),
             "min_margin_mm": 1e3 * _margin(plan, index)}
            for index, step in enumerate(plan.footsteps)],
    }


def plan_text(plan: WalkPlan, robot: RobotModel, planning_time: float) -> str:
    """Return a walk as tables for people; the arguments are those of `plan_object`."""
    found = plan_object(plan, robot, planning_time)
    goal, clearance = found["goal"], found["clearance"]
    rows = [
        ("goal", f"x {goal['x']:.3f} m, y {goal['y']:.3f} m, yaw {goal['yaw_deg']:.1f} deg"),
        ("footsteps", f"{len(plan.footsteps)}"),
        ("duration", f"{plan.duration:.2f} s"),
        ("smallest ZMP margin", f"{found['min_margin_mm']:.1f} mm"),
        ("friction needed", f"{found['required_friction']:.2f}"),
        ("fastest joints", _largest(found["speed_ratio"])),
        ("largest torques", _largest(found["torque_ratio"])),
    ]
    if clearance is not None:
        rows.append(("smallest clearance", f"{clearance['distance_mm']:.0f} mm between "
                     f"{' and '.join(clearance['bodies'])} ({clearance['limit_mm']:.0f} mm "
                     "required)"))
    rows.append(("planned in", f"{found['planning_ms']:.0f} ms"))
    lines = [f"{name:<22}{value}" for name, value in rows]
    if plan.footsteps:
        lines += ["", f"{'step':>4}  {'foot':<6}{'x [m]':>8}{'y [m]':>8}{'yaw [deg]':>11}"
                  f"{'begins [s]':>12}{'lands [s]':>11}{'margin [mm]':>13}"]
    for number, step in enumerate(found["footsteps"], start=1):
        lines.append(
            f"{number:>4}  {step['side']:<6}{step['x']:>8.3f}{step['y']:>8.3f}"
            f"{step['yaw_deg']:>11.1f}{step['begin']:>12.2f}{step['touchdown']:>11.2f}"
            f"{step['min_margin_mm']:>13.1f}")
    return "\n".join(lines)


def _by_joint(robot: RobotModel, values: Any) -> dict[str, float]:
    return dict(zip(robot.joint_names, np.asarray(values).tolist(), strict=True))


def _largest(shares: dict[str, float]) -> str:
    names = sorted(shares, key=lambda name: -shares[name])[:_SHOWN_JOINTS]
    return ", ".join(f"{name} {100.0 * shares[name]:.0f} %" for name in names) + " of their limits"


def _margin(plan: WalkPlan, step: int) -> float:
    """Smallest ZMP margin from a step's beginning to its touchdown [m]."""
    first, last = (round(time / plan.schedule.period)
                   for time in (plan.begin_of(step), plan.touchdown_of(step)))
    return float(plan.checks.margin[first : last + 1].min())
