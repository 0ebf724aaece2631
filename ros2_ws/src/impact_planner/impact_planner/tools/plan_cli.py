"""Command ``plan``: plans an impact without ROS nodes."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_impact_common.files import draw_into, run_command
from door_model.door.config import door_names, load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel

from impact_planner.hit.placement import configured_placement
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import ENDINGS, RUN_UPS, make_settings
from impact_planner.tools.plan_text import finite, plan_object, plan_text

_EXAMPLE = """\
example, the paper's door, then one that identify has written:
  ros2 run impact_planner plan --angle-deg 25 --plot plan.png
  ros2 run impact_planner plan --angle-deg 25 --door my_door.yaml --run-up zmp_limited
"""


def build_parser() -> argparse.ArgumentParser:
    """Make the parser of the command's arguments."""
    parser = argparse.ArgumentParser(
        prog="plan", epilog=_EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Plan an impact that opens a swing door to an angle.")
    add = parser.add_argument
    add("--angle-deg", type=float, required=True, help="opening angle [deg]")
    add("--door", default="paper", metavar="NAME_OR_YAML",
        help=f"{', '.join(door_names())}, or a YAML file (default: %(default)s)")
    add("--robot", metavar="YAML",
        help="robot.yaml of another robot; the door stands where its step ends (default: HRP-2)")
    add("--run-up", choices=RUN_UPS,
        help="the paper's cam curve, or the largest ZMP margin for faster hits (default: mcv50)")
    add("--ending", choices=ENDINGS, help="phase after the door's largest angle (default: hold)")
    add("--restitution", type=float,
        help="coefficient of restitution, 0 (plastic) to 1 (default: the door's)")
    add("--effective-mass", type=float,
        help="effective mass of the robot at B [kg] (default: the model's)")
    add("--door-distance", type=float,
        help="distance from the origin of odom to the leaf's face [m] (default: as configured)")
    add("--hinge-x", type=float, help="x of the hinge in odom [m] (default: as configured)")
    add("--anywhere", action="store_true",
        help="the door stands where the nominal or a shorter step ends, not as configured")
    add("--plot", type=Path, metavar="FILE", help="draw the plan (PNG, PDF, SVG)")
    add("--json", action="store_true", help="print one JSON object")
    return parser


def main(args: list[str] | None = None) -> int:
    """Run the command, and return its exit status: 0, or 1 with the reason on stderr."""
    options = build_parser().parse_args(args)
    return run_command("plan", lambda: _answer(options))


def _answer(options: argparse.Namespace) -> str:
    robot = RobotModel(load_robot_config(options.robot))
    try:
        plan = _plan(options, robot)
    except (ValueError, ArithmeticError, np.linalg.LinAlgError, MemoryError) as error:
        if options.robot is None:
            raise
        raise DoorImpactError(
            f"no hit can be planned for the robot of {options.robot}: {error}") from error
    if options.plot is not None:
        draw_into(options.plot, lambda: _draw(plan, robot, options.plot))
    return json.dumps(finite(plan_object(plan)), allow_nan=False) if options.json else (
        plan_text(plan))


def _plan(options: argparse.Namespace, robot: RobotModel) -> ImpactPlan:
    """Plan what the options describe, with the settings of the installed parameter file."""
    # The configured place of the door was surveyed for HRP-2's stance.
    own = options.robot or options.anywhere
    place = {} if own else vars(configured_placement(robot))
    settings = make_settings(
        place if options.hinge_x is None else place | {"hinge_x": options.hinge_x}, robot)
    config = load_door(options.door)
    request = PlanRequest(
        desired_opening_angle=math.radians(options.angle_deg),
        restitution=config.restitution if options.restitution is None else options.restitution,
        effective_mass=options.effective_mass,
        door_distance=options.door_distance,
        run_up=options.run_up,
        ending=options.ending,
    )
    return plan_impact(request, KnownDoor.configured(config), robot, settings)


def _draw(plan: ImpactPlan, robot: RobotModel, path: Path) -> None:
    from impact_planner.tools.plotting import draw_plan

    draw_plan(plan, robot, path)


if __name__ == "__main__":
    sys.exit(main())
