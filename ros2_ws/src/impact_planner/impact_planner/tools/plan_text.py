"""A plan as text for people and as a JSON object for scripts."""

from __future__ import annotations

import math
from typing import Any

from impact_planner.impact_plan import FIGURES, ImpactPlan

_SHOWN_LOADS = 4  # number of the most loaded gears in the text


def plan_object(plan: ImpactPlan) -> dict[str, Any]:
    """Return the plan as a JSON object: the object `plan` of summary.json, and further figures."""
    figures = {name: getattr(plan, name) for name in FIGURES}
    margins = {name: 1e3 * figures.pop(name) for name in (
        "early_margin", "late_margin", "missed_margin")}
    phases, hit = plan.phases, plan.hit
    return {
        "plan_id": plan.plan_id,
        **{name: one for name, one in figures.items() if isinstance(one, float | str)},
        **{f"{name}_mm": margin for name, margin in margins.items()},
        "required_friction": plan.required_friction,
        "steady_way": plan.steady_way,
        "planning_ms": 1e3 * plan.planning_time,
        "target_deg": math.degrees(plan.desired_opening_angle),
        "step": hit.stance.step,
        "door_distance": hit.placement.door_distance,
        "hinge_x": hit.placement.hinge_x,
        "contact_ms": 1e3 * plan.contact_duration,
        "brace_impulse_nms": hit.transfer.brace,
        "pads": {"preload": plan.pad_preload, "force": plan.pad_force,
                 "friction_share": plan.pad_friction},
        "joint_loads": {
            load.joint: {"gear_torque": load.gear_torque, "peak_torque": load.peak_torque,
                         "share": load.share, "motor_impulse": load.motor_impulse}
            for load in plan.joint_loads},
        "planned_margin_mm": {name: 1e3 * m for name, m in plan.zmp_margins.items()},
        "speed_ratio": {phase.name: phase.speed_ratio for phase in phases},
        "torque_ratio": {phase.name: phase.torque_ratio for phase in phases},
        "body_clearance_mm": {p.name: 1e3 * p.clearances[0].distance for p in phases},
        "leaf_clearance_mm": {p.name: 1e3 * p.clearances[1].distance for p in phases},
        "warnings": list(plan.warnings),
    }


def finite(value: Any) -> Any:
    """Return a JSON value with null in place of numbers that are not finite, which JSON lacks."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def plan_text(plan: ImpactPlan) -> str:
    """Return the plan as a table for people; each row names the paper's equation or section."""
    lines = [f"{name:<28}{source:<16}{value}" for name, source, value in _rows(plan)]
    return "\n".join(
        [*lines, "", *_phase_lines(plan), *(f"warning: {warning}" for warning in plan.warnings)])


def _rows(plan: ImpactPlan) -> list[tuple[str, str, str]]:
    """Return rows of name, source in the paper and value."""
    desired, peak, std = map(
        math.degrees, (plan.desired_opening_angle, plan.peak_angle, plan.peak_angle_std))
    spread = f" +- {std:.2f}" if std > 0.0 else ""
    pads = f"pads {plan.pad_preload:.0f} N, in the hit up to {plan.pad_force:.0f} N, " \
           f"{100.0 * plan.pad_friction:.0f} % of their friction; " if plan.pad_force > 0.0 else ""
    gears = ", ".join(
        f"{load.joint} {abs(load.gear_torque):.0f} of {load.peak_torque:.0f} N m"
        for load in plan.joint_loads[:_SHOWN_LOADS])
    back, missed = 1e3 * plan.point_of_no_return, 1e3 * plan.missed_margin
    return [
        ("door, opening angle", "", f"{plan.door}, {desired:.1f} deg"),
        ("stance", "II.C.1, Fig. 5",
         f"step {plan.hit.stance.step:.3f} m, door {plan.hit.placement.door_distance:.3f} m from "
         f"the origin, l_B {plan.l_b:.3f} m"),
        ("w' of the door", "(1), II.C.2", f"{plan.omega_door:.3f} rad/s"),
        ("predicted peak", "(1)", f"{peak:.2f}{spread} deg, {plan.peak_time:.2f} s after the hit"),
        ("I_rob, a_r", "(3)", f"{plan.i_rob:.2f} kg m^2, {plan.a_r:.3f} m"),
        ("m_re of a free body", "(3)", f"{plan.effective_mass_planar:.1f} kg"),
        ("m_re planned with", "ours",
         f"{plan.effective_mass:.1f} kg; {plan.effective_mass_model:.1f} by the simulated hit"),
        ("learned from hits", "", f"{plan.learned_hits or 'none yet'}"),
        ("impulse at B", "(2)", f"{plan.required_impulse:.1f} N s"),
        ("v_rB", "(4) corrected", f"{plan.v_rb:.3f} m/s"),
        ("v'_rB", "restitution",
         f"{plan.v_rb_post:.3f} m/s, e = {plan.apparent_restitution:.2f} on a leaf with "
         f"{plan.restitution:.2f}"),
        ("contact", "ours",
         f"{1e3 * plan.contact_duration:.0f} ms, up to {plan.peak_force:.0f} N"),
        ("b_r, b_r that (5) asks for", "(5)",
         f"{plan.b_r:.3f}, {plan.b_r_percussion:.3f} m, waist at {plan.waist_height:.3f} m"),
        ("feet in the hit", "(5)",
         f"{plan.foot_impulse:.1f} N s across ({abs(plan.foot_impulse_planar):.1f} by (5) alone), "
         f"{plan.foot_yaw_impulse:.2f} N m s about the vertical, friction "
         f"{plan.hit.transfer.floor.friction:.2f}"),
        ("brace", "II.C.1", f"{pads}{plan.brace_joint} gets {abs(plan.brace_impulse):.1f} N m s"),
        *([("gears", "ours", gears)] if gears else []),
        ("run-up", "Fig. 6" if plan.run_up == "mcv50" else "ours",
         f"{plan.run_up}, CoM to {plan.v_com:.3f} m/s in {plan.contact_time:.2f} s, steady over "
         f"{1e3 * plan.steady_way:.0f} mm"),
        ("door nearer, farther", "",
         f"by {500.0 * plan.steady_way:.0f} mm: ZMP margin {1e3 * plan.early_margin:.0f}, "
         f"{1e3 * plan.late_margin:.0f} mm"),
        ("point of no return", "",
         f"{back:.0f} ms before the contact; a stop before it takes {plan.stop_duration:.1f} s"),
        ("missed contact", "",
         f"capture point {abs(missed):.0f} mm {'inside' if missed >= 0.0 else 'beyond'} the soles "
         "when it is noticed"),
        ("friction needed", "", f"{plan.required_friction:.2f}"),
        ("planned in", "", f"{1e3 * plan.planning_time:.0f} ms"),
    ]


def _phase_lines(plan: ImpactPlan) -> list[str]:
    """Return a table of the phases' ZMP margins, shares of joint limits and nearest bodies."""
    lines = [f"{'phase':<9}{'ZMP margin':>12}{'speed':>8}{'torque':>8}   nearest bodies"]
    for phase in plan.phases:
        near = "; ".join(
            f"{1e3 * clearance.distance:.0f} mm {' - '.join(clearance.bodies)}"
            for clearance in phase.clearances)
        lines.append(
            f"{phase.name:<9}{1e3 * phase.margin:>9.0f} mm{100.0 * phase.speed_ratio:>6.0f} %"
            f"{100.0 * phase.torque_ratio:>6.0f} %   {near}")
    return lines
