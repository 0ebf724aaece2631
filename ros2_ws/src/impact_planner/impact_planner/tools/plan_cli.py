"""Command ``plan``: plans an impact without ROS nodes."""

from __future__ import annotations

import argparse
import json
import math
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from door_impact_common.drawing import is_drawn
from door_impact_common.errors import DoorImpactError
from door_model.door.config import door_names, load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import AngleUnreachable
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.reach import furthest_contact, largest_angle
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import (
    ENDINGS,
    RUN_UPS,
    PlannerSettings,
    configured_placement,
    make_settings,
)
from impact_planner.tools.plan_text import finite, plan_object, plan_text, reach_lines

_EXAMPLE = """\
example, the paper's door, then one that identify has written:
  ros2 run impact_planner plan --angle-deg 25 --plot plan.png
  ros2 run impact_planner plan --angle-deg 25 --door my_door.yaml --run-up zmp_limited
"""


def build_parser() -> argparse.ArgumentParser:
    """Make the parser of the command's arguments."""
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
        help=f"{', '.join(door_names())}, or a YAML file (default: %(default)s)",
    )
    parser.add_argument(
        "--robot",
        metavar="YAML",
        help="robot.yaml of another robot; the door stands where its nominal step ends (default: "
        "HRP-2)",
    )
    parser.add_argument(
        "--run-up",
        choices=RUN_UPS,
        help="the paper's cam curve, or the course with the largest ZMP margin, for faster hits "
        "(default: mcv50)",
    )
    parser.add_argument(
        "--ending", choices=ENDINGS, help="phase after the door's largest angle (default: hold)")
    parser.add_argument(
        "--restitution", type=float,
        help="coefficient of restitution, 0 (plastic) to 1 (default: the door's)")
    parser.add_argument(
        "--effective-mass", type=float,
        help="effective mass of the robot at B [kg] (default: the model's)")
    parser.add_argument(
        "--door-distance",
        type=float,
        help="distance from the origin of odom to the leaf's face [m] (default: as configured)",
    )
    parser.add_argument(
        "--hinge-x", type=float, help="x of the hinge in odom [m] (default: as configured)")
    parser.add_argument(
        "--anywhere", action="store_true",
        help="ignore the configured place of the door: it stands where the nominal step, or a "
        "shorter one, ends")
    parser.add_argument(
        "--reach", action="store_true",
        help="also print the largest angle at which the arm could hold the door, and the largest "
        "l_B from which it could hold it at this angle (takes some seconds)")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw the plan (PNG, PDF, SVG)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def main(args: list[str] | None = None) -> int:
    """Run the command.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        Exit status: 0, or 1 after a failure, whose reason is printed on stderr.
    """
    options = build_parser().parse_args(args)
    try:
        robot = RobotModel(load_robot_config(options.robot))
        settings = _settings(options)
        known, request = _asked(options)
        plan = plan_impact(request, known, robot, settings)
        reach = _reach(plan, known, robot, settings) if options.reach else {}
    except DoorImpactError as error:
        print(f"plan: {error}", file=sys.stderr)
        return 1
    except (ValueError, ArithmeticError, np.linalg.LinAlgError, MemoryError) as error:
        if options.robot is None:
            raise
        print(f"plan: no hit can be planned for the robot of {options.robot}: {error}",
              file=sys.stderr)
        return 1
    if options.plot is not None and not _drawn(plan, robot, settings, options.plot):
        return 1
    if options.json:
        print(json.dumps(finite(plan_object(plan) | reach), allow_nan=False))
    else:
        print(plan_text(plan), *reach_lines(reach), sep="\n")
    return 0


def _drawn(
    plan: ImpactPlan, robot: RobotModel, settings: PlannerSettings, path: Path
) -> bool:
    """Draw the plan, and return whether that succeeded; a failure is printed on stderr."""
    def draw() -> None:
        from impact_planner.tools.plotting import draw_plan

        draw_plan(plan, robot, settings, path)

    return is_drawn("plan", path, draw)


def _settings(options: argparse.Namespace) -> PlannerSettings:
    """Settings of the installed parameter file with the command's options."""
    # The configured place of the door was surveyed for HRP-2's stance.
    own = options.robot or options.anywhere
    settings = make_settings({} if own else configured_placement())
    return settings if options.hinge_x is None else replace(settings, hinge_x=options.hinge_x)


def _asked(options: argparse.Namespace) -> tuple[KnownDoor, PlanRequest]:
    """The door and the request that the options describe."""
    config = load_door(options.door)
    request = PlanRequest(
        desired_opening_angle=math.radians(options.angle_deg),
        restitution=config.restitution if options.restitution is None else options.restitution,
        effective_mass=options.effective_mass,
        door_distance=options.door_distance,
        run_up=options.run_up,
        ending=options.ending,
    )
    return KnownDoor.configured(config), request


def _reach(
    plan: ImpactPlan, known: KnownDoor, robot: RobotModel, settings: PlannerSettings
) -> dict[str, float | None]:
    """Largest angle [deg] and largest l_B [m] with which the arm could hold the door.

    Both are for the plan's stance, and None where the arm can hold the door nowhere.
    """
    placement = plan.hit.placement
    stance = plan.hit.stance
    found: dict[str, float | None] = {"largest_held_angle_deg": None, "furthest_l_b": None}
    with suppress(AngleUnreachable):  # a plan with a retreat may have no angle that can be held
        found["largest_held_angle_deg"] = math.degrees(
            largest_angle(robot, known, settings, placement, stance))
    with suppress(AngleUnreachable):
        found["furthest_l_b"] = furthest_contact(
            robot, known, settings, placement, stance, plan.desired_opening_angle)
    return found


if __name__ == "__main__":
    sys.exit(main())
