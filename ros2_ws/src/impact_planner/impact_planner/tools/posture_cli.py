"""Command ``find_posture``: which body of the right arm hits best, and in which braced posture."""

from __future__ import annotations

import argparse
import math
import sys
from typing import Any

import pinocchio as pin
from door_impact_common.errors import DoorImpactError
from door_impact_common.files import run_command
from door_impact_common.yaml_files import yaml_text
from door_model.door.config import door_names, load_door
from hrp2_description.robot import RobotConfig, load_robot_config
from humanoid_motion.clearance import bodies_of
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import PLANNING_ERRORS
from impact_planner.hit.arm_search import ArmSearch
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest, resolve
from impact_planner.task.settings import RUN_UPS, make_settings

_SHOWN = 3  # number of postures that are printed at most, and that are planned with for a link
_EXAMPLE = """\
example; the printed lines take the place of those in my_robot.yaml:
  ros2 run impact_planner find_posture my_robot.yaml --door light --angle-deg 15
"""


def main(args: list[str] | None = None) -> int:
    """Run the command, and return its exit status: 0, or 1 with the reason on stderr."""
    parser = argparse.ArgumentParser(
        prog="find_posture", epilog=_EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Find the body of the right arm that hits, and the braced arm's posture.")
    add = parser.add_argument
    add("robot", nargs="?", metavar="YAML", help="robot.yaml (default: HRP-2's)")
    add("--door", default="paper", metavar="NAME_OR_YAML",
        help=f"{', '.join(door_names())}, or a YAML file (default: %(default)s)")
    add("--angle-deg", type=float, default=25.0, help="opening angle [deg] (default: %(default)g)")
    add("--run-up", choices=RUN_UPS, default="zmp_limited",
        help="that the plans are made with (default: %(default)s)")
    options = parser.parse_args(args)
    return run_command("find_posture", lambda: _answer(options))


def _answer(options: argparse.Namespace) -> str:
    door, robot = load_door(options.door), load_robot_config(options.robot)
    request = PlanRequest(math.radians(options.angle_deg), restitution=door.restitution,
                          run_up=options.run_up, ending="retreat")
    return "\n".join(_text(*found) for found in find_postures(
        robot, request, KnownDoor.configured(door)))


def find_postures(
    config: RobotConfig, request: PlanRequest, known: KnownDoor
) -> list[tuple[RobotConfig, ImpactPlan]]:
    """Find contact bodies and braced postures: three at most, those of the slowest hit first.

    Raises:
        DoorImpactError: No posture counts, or with none of them the hit can be planned.
    """
    robot, found, refusals = RobotModel(config), [], {}
    settings = make_settings({}, robot)
    resolve(request, settings, known)  # a bad request is refused before the search
    search = ArmSearch(robot, settings)
    for link in search.links():
        candidates, refusals[link] = search.best(link, _SHOWN)
        for one in candidates:
            try:
                found.append((one, plan_impact(request, known, RobotModel(one), settings)))
            except PLANNING_ERRORS as error:
                refusals[link] = str(error)
    if not found:
        reasons = "; ".join(f"{link}: {reason}" for link, reason in refusals.items())
        raise DoorImpactError(f"no posture for the hit was found; {reasons}")
    return sorted(found, key=lambda each: (len(each[1].warnings), each[1].v_rb))[:_SHOWN]


def _text(config: RobotConfig, plan: ImpactPlan) -> str:
    distance, bodies = _nearest_to_arm(RobotModel(config), plan)
    lines = (
        f"v_rB {plan.v_rb:.3f} m/s, m_re {plan.effective_mass:.1f} kg (eq. (3): "
        f"{plan.effective_mass_planar:.1f}), b_r {plan.b_r:.3f} m (eq. (5): "
        f"{plan.b_r_percussion:.3f}), arm clear by {1e3 * distance:.0f} mm ({bodies})",
        *(f"warning: {warning}" for warning in plan.warnings))
    return "".join(f"# {line}\n" for line in lines) + yaml_text(robot_fields(config))


def _nearest_to_arm(robot: RobotModel, plan: ImpactPlan) -> tuple[float, str]:
    """Return the least distance of the arm from the rest of the robot in the hit [m], and where."""
    bodies, posture = bodies_of(robot), plan.hit.stance.posture
    shapes, data = bodies.shapes, bodies.shapes.createData()
    pin.updateGeometryPlacements(robot.model, robot.data, shapes, data,
                                 robot.configuration(posture.base, posture.joints))
    arm = set(robot.model.subtrees[robot.model.getJointId(robot.config.arm.joints[0])])
    moved = [int(item.parentJoint) in arm for item in shapes.geometryObjects]
    return min(((pin.computeDistance(shapes, data, number).min_distance,
                 f"{bodies.links[pair.first]} - {bodies.links[pair.second]}")
                for number, pair in enumerate(shapes.collisionPairs)
                if moved[pair.first] != moved[pair.second]), default=(math.inf, "no shapes"))


def robot_fields(config: RobotConfig) -> dict[str, Any]:
    """Return the fields of robot.yaml that are found."""
    brace, found = config.brace, {
        "contact_link": config.contact_link, "contact_radius": config.contact_radius,
        "braced_posture_deg": {
            name: round(math.degrees(angle), 2) for name, angle in config.braced_posture.items()}}
    if brace is None:
        return found
    arm, trunk = ({"link": pad.link, "xyz": [*pad.place], "radius": pad.size}
                  for pad in (brace.arm, brace.trunk))
    return found | {"brace": {
        "arm": arm, "trunk": trunk | {"normal": [*brace.normal]},
        "stiffness": brace.stiffness, "damping": brace.damping, "friction": brace.friction}}


if __name__ == "__main__":
    sys.exit(main())
