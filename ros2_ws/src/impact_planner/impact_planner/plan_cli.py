"""Command ``plan``: plans an impact without a graph."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from door_model.config import door_names, load_door
from door_model.errors import DoorModelError
from hrp2_description.errors import DescriptionError
from hrp2_description.robot import load_robot_config

from .errors import PlannerError
from .plan import plan_impact
from .plan_types import ENDINGS, RUN_UPS, ImpactPlan, KnownDoor, PlanRequest
from .robot_model import RobotModel
from .settings import configured_placement, make_settings

# The contract's keys of `plan` in summary.json.
_JSON_KEYS = (
    "omega_door", "v_rb", "v_rb_post", "effective_mass", "effective_mass_planar", "a_r", "b_r",
    "i_rob", "l_b",
)  # fmt: skip


_EXAMPLE = """\
example, the paper's door, then one that identify has written:
  ros2 run impact_planner plan --angle-deg 25 --plot plan.png
  ros2 run impact_planner plan --angle-deg 25 --door my_door.yaml --run-up zmp_limited
"""


def build_parser() -> argparse.ArgumentParser:
    """Arguments of the command."""
    parser = argparse.ArgumentParser(
        prog="plan",
        description="Plan an impact that opens a swing door to an angle, and print it with the "
        "paper's equations.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--angle-deg", type=float, required=True, help="opening angle [deg]")
    parser.add_argument(
        "--door",
        default="paper",
        metavar="NAME_OR_YAML",
        help=f"of {', '.join(door_names())}, or a YAML file (default: %(default)s)",
    )
    parser.add_argument(
        "--robot",
        metavar="YAML",
        help="robot.yaml of another robot, whose nominal step says where the door stands "
        "(default: HRP-2)",
    )
    parser.add_argument(
        "--run-up",
        choices=RUN_UPS,
        help="the paper's cam curve, or the course with the largest ZMP margin, for faster hits "
        "(default: mcv50)",
    )
    parser.add_argument(
        "--ending", choices=ENDINGS, help="what follows the door's peak (default: hold)")
    parser.add_argument(
        "--restitution", type=float, help="coefficient, 0 (plastic) to 1 (default: the door's)")
    parser.add_argument(
        "--effective-mass", type=float, help="of the robot at B [kg] (default: of its model)")
    parser.add_argument(
        "--door-distance",
        type=float,
        help="from the origin of odom to the leaf's face [m] (default: as configured)",
    )
    parser.add_argument(
        "--hinge-x", type=float, help="x of the hinge in odom [m] (default: as configured)")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw the plan (PNG, PDF, SVG)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def main(args: list[str] | None = None) -> int:
    """Plan and print; 1 where there is no plan, with the reason on stderr."""
    options = build_parser().parse_args(args)
    try:
        plan = _plan(options)
        if options.plot is not None:
            from .plotting import draw_plan

            draw_plan(plan, options.plot)
    except (PlannerError, DoorModelError, DescriptionError) as error:
        print(f"plan: {error}", file=sys.stderr)
        return 1
    except (OSError, ValueError, ImportError) as error:  # of the drawing alone
        print(f"plan: cannot draw {options.plot}: {error}", file=sys.stderr)
        return 1
    print(json.dumps(plan_object(plan)) if options.json else plan_text(plan))
    return 0


def _plan(options: argparse.Namespace) -> ImpactPlan:
    config = load_door(options.door)
    # The configured door was surveyed for HRP-2's stance.
    settings = make_settings({} if options.robot else configured_placement())
    if options.hinge_x is not None:
        settings = replace(settings, hinge_x=options.hinge_x)
    request = PlanRequest(
        desired_opening_angle=math.radians(options.angle_deg),
        restitution=config.restitution if options.restitution is None else options.restitution,
        effective_mass=options.effective_mass,
        door_distance=options.door_distance,
        run_up=options.run_up,
        ending=options.ending,
    )
    known = KnownDoor(config.name, config.door(), config.leaf.width)
    return plan_impact(request, known, RobotModel(load_robot_config(options.robot)), settings)


def plan_object(plan: ImpactPlan) -> dict[str, Any]:
    """The contract's `plan` object and what else a caller may want."""
    found: dict[str, Any] = {key: float(getattr(plan, key)) for key in _JSON_KEYS}
    found["planning_ms"] = 1e3 * plan.planning_time
    found |= {
        "plan_id": plan.plan_id,
        "door": plan.door,
        "run_up": plan.run_up,
        "ending": plan.ending,
        "target_deg": math.degrees(plan.desired_opening_angle),
        "restitution": plan.restitution,
        "v_com": plan.v_com,
        "required_impulse": plan.required_impulse,
        "required_friction": plan.required_friction,
        "b_r_percussion": plan.b_r_percussion,
        "waist_height": plan.waist_height,
        "step": plan.step,
        "door_distance": plan.door_distance,
        "hinge_x": plan.hinge_x,
        "contact_time": plan.contact_time,
        "peak_time": plan.peak_time,
        "point_of_no_return": plan.point_of_no_return,
        "planned_margin_mm": {name: 1e3 * m for name, m in plan.zmp_margins.items()},
        "warnings": list(plan.warnings),
    }
    return found


def plan_text(plan: ImpactPlan) -> str:
    """The plan for people to read, each row with the paper's equation or section."""
    target = math.degrees(plan.desired_opening_angle)
    margins = ", ".join(f"{name} {1e3 * margin:.0f}" for name, margin in plan.zmp_margins.items())
    back = 1e3 * plan.point_of_no_return
    peak = f"{math.degrees(plan.peak_angle):.2f}"
    if plan.peak_angle_std > 0.0:
        peak += f" +- {math.degrees(plan.peak_angle_std):.2f}"
    rows = [
        ("door, opening angle", "", f"{plan.door}, {target:.1f} deg"),
        ("w' of the door", "(1), II.C.2", f"{plan.omega_door:.3f} rad/s"),
        ("predicted peak", "(1)", f"{peak} deg, {plan.peak_time:.2f} s after the hit"),
        ("I_rob, a_r", "(3)", f"{plan.i_rob:.2f} kg m^2, {plan.a_r:.3f} m"),
        ("m_re of a free body", "(3)", f"{plan.effective_mass_planar:.1f} kg"),
        ("m_re planned with", "J M^-1 J^T", f"{plan.effective_mass:.1f} kg, feet on the floor"),
        ("b_r, b_r that (5) asks for", "(5)",
         f"{plan.b_r:.3f}, {plan.b_r_percussion:.3f} m, waist at {plan.waist_height:.3f} m"),
        ("impulse at B, l_B", "(2)", f"{plan.required_impulse:.1f} N s, {plan.l_b:.3f} m"),
        ("v_rB", "(4) corrected", f"{plan.v_rb:.3f} m/s"),
        ("v'_rB", "restitution", f"{plan.v_rb_post:.3f} m/s, e = {plan.restitution:.2f}"),
        ("run-up", "Fig. 6" if plan.run_up == "mcv50" else "ours",
         f"{plan.run_up}, CoM to {plan.v_com:.3f} m/s in {plan.contact_time:.2f} s"),
        ("stance", "II.C.1, Fig. 5",
         f"step {plan.step:.3f} m, door {plan.door_distance:.3f} m from the origin"),
        ("friction, feet", "", f"{plan.required_friction:.2f}"),
        ("ZMP margin [mm]", "", margins),
        ("point of no return", "", f"{abs(back):.0f} ms {'before' if back > 0.0 else 'after'} the "
         "contact"),
        ("planned in", "", f"{1e3 * plan.planning_time:.0f} ms"),
    ]  # fmt: skip
    lines = [f"{name:<28}{source:<16}{value}" for name, source, value in rows]
    return "\n".join(lines + [f"warning: {warning}" for warning in plan.warnings])


if __name__ == "__main__":
    sys.exit(main())
