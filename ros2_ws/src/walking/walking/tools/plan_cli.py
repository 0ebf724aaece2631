"""Command ``plan``: plans a walk without ROS nodes."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from time import perf_counter

from door_impact_common.drawing import is_drawn
from door_impact_common.errors import DoorImpactError
from hrp2_description.robot import load_robot_config, needed
from humanoid_motion.clearance import bodies_of
from humanoid_motion.robot_model import RobotModel

from walking.footsteps.footstep import Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import standing
from walking.pattern.walk_plan import WalkPlan
from walking.tools.plan_text import plan_object, plan_text

_EXAMPLE = """\
examples:
  ros2 run walking plan --forward 2 --turn-deg 90 --plot walk.png
  ros2 run walking plan --left 0.6 --keep-heading
"""


def build_parser() -> argparse.ArgumentParser:
    """Make the parser of the command's arguments."""
    defaults = WalkSettings()
    parser = argparse.ArgumentParser(
        prog="plan",
        description="Plan a walk from half-sitting at the origin, and print its footsteps and "
        "margins.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for name, what in (("forward", "way ahead, negative backwards"), ("left", "way to the left")):
        parser.add_argument(
            f"--{name}", type=float, default=0.0, metavar="M",
            help=f"{what} [m] (default: %(default)s)")
    parser.add_argument(
        "--turn-deg", type=float, default=0.0, metavar="DEG",
        help="turn of the robot, positive to the left; more than half a turn is made in full [deg] "
        "(default: %(default)s)")
    parser.add_argument(
        "--keep-heading", action="store_true",
        help="walk straight to the goal, sideways if need be, instead of facing the way")
    parser.add_argument(
        "--step-time", type=float, default=0.8, metavar="S",
        help="duration of a step [s] (default: %(default)s)")
    parser.add_argument(
        "--waist-height", type=float, default=defaults.waist_height, metavar="M",
        help="height of base_link while walking [m] (default: %(default)s)")
    parser.add_argument(
        "--robot", metavar="YAML", help="robot.yaml of another robot (default: HRP-2)")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw the walk (PNG, PDF, SVG)")
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
        bodies_of(robot)  # reads the shapes, which takes longer than planning
        begin = perf_counter()
        plan = _planned(robot, options)
        planning_time = perf_counter() - begin
    except DoorImpactError as error:
        print(f"plan: {error}", file=sys.stderr)
        return 1
    if options.plot is not None and not _drawn(plan, robot, options.plot):
        return 1
    if options.json:
        print(json.dumps(plan_object(plan, robot, planning_time), allow_nan=False))
    else:
        print(plan_text(plan, robot, planning_time))
    return 0


def _planned(robot: RobotModel, options: argparse.Namespace) -> WalkPlan:
    width = needed(robot.config.footsteps, "footsteps").width
    stance = Stance.around(Pose(0.0, 0.0, 0.0), width)
    goal = Pose(options.forward, options.left, math.radians(options.turn_deg))
    footsteps = plan_footsteps(
        robot.config, stance, goal, options.step_time, keep_heading=options.keep_heading,
        whole_turns=True)
    settings = WalkSettings(waist_height=options.waist_height)
    return plan_walk(robot, standing(robot, stance), footsteps, settings)


def _drawn(plan: WalkPlan, robot: RobotModel, path: Path) -> bool:
    """Draw the walk, and return whether that succeeded; a failure is printed on stderr."""
    def draw() -> None:
        from walking.tools.plotting import draw_walk

        draw_walk(plan, robot, path)

    return is_drawn("plan", path, draw)
