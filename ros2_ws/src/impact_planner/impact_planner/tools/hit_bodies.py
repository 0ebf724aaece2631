"""Command ``hit_bodies``: what could hit the leaf, and what each choice loads.

It compares the configured braced posture with others that lean on the trunk, with the free arm, and
with other bodies of the robot, for one angle on one door. The figures are those of the planner's
simulated hit; no motion is planned.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_model.door.config import door_names, load_door
from hrp2_description.robot import RobotConfig, load_robot_config
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import InvalidRequest
from impact_planner.hit.brace import braced_arm
from impact_planner.hit.door_prediction import predict
from impact_planner.hit.stance import contact_with_leaf, stance_for_step
from impact_planner.hit.transfer import MomentumTransfer, plan_transfer
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest, resolve
from impact_planner.task.settings import PlannerSettings

_DISTANCES = (0.41, 0.42, 0.44, 0.45)
_LINKS = ("RARM_LINK1", "RLEG_LINK1")
_LOADS = 2  # number of gears that a row names
_EXAMPLE = """\
example, the postures and bodies of docs/planner.md:
  ros2 run impact_planner hit_bodies
another robot, which has other links:
  ros2 run impact_planner hit_bodies --robot my_robot.yaml --links right_shoulder
"""


@dataclass(frozen=True)
class Body:
    """A body of the robot in the posture in which it is to hit.

    Attributes:
        name: Words for body and posture.
        config: Configuration of the robot that hits with it; None if it has no such posture.
        refusal: Why it has none.
    """

    name: str
    config: RobotConfig | None
    refusal: str = ""


@dataclass(frozen=True)
class BodyHit:
    """The hit of a body.

    Attributes:
        name: Words for body and posture.
        transfer: The hit; None if the robot has no such posture.
        refusal: Why it has none.
    """

    name: str
    transfer: MomentumTransfer | None
    refusal: str = ""


def bodies(config: RobotConfig, distances: Iterable[float], links: Iterable[str]) -> Iterator[Body]:
    """Yield the bodies that are compared.

    Args:
        config: The robot. Without a brace it has no posture that leans on the trunk.
        distances: Distances of the elbow from the middle of the robot [m].
        links: Links that hit while the arm hangs as in half-sitting. Each is a sphere around its
            origin, as large as the configured body that hits.

    Raises:
        InvalidRequest: The robot has no such link.
    """
    robot = RobotModel(config)
    for link in links:
        if not robot.model.existBodyName(link):
            raise InvalidRequest(
                f"the robot has no link {link!r}", quantity="link", value=link,
                limit="a link of the URDF")
    yield Body(f"{config.contact_link}, as configured", config)
    if config.brace is not None:
        for distance in distances:
            if not math.isfinite(distance):
                raise InvalidRequest(
                    "the distance of the elbow is not finite", quantity="distance [m]",
                    value=distance, limit="a finite number")
            name = f"elbow at {distance:.3f} m"
            try:
                arm = braced_arm(robot, distance)
            except PostureUnreachable as error:
                yield Body(name, None, str(error))
            else:
                yield Body(f"{name}, pad at z = {arm.pad[2]:.3f} m", arm.of(config))
        yield Body(f"{config.contact_link}, free arm in the same posture",
                   replace(config, brace=None))
    for link in links:
        yield Body(f"{link}, arm as in half-sitting", replace(
            config, brace=None, contact_link=link, braced_posture=MappingProxyType({})))


def compare(
    over: Iterable[Body], known: KnownDoor, settings: PlannerSettings, angle: float
) -> Iterator[BodyHit]:
    """Simulate the hit of each body that opens the shut door to an angle.

    The right foot takes the nominal step, and the leaf stands where the body meets it at the
    nominal l_B.

    Args:
        over: The bodies.
        known: The door.
        settings: Configuration of the planner.
        angle: Desired opening angle [rad].

    Raises:
        InvalidRequest: The angle is outside its range.
        AngleUnreachable: The door cannot be opened so far.
    """
    wanted = resolve(PlanRequest(angle, initial_angle=0.0), settings, known)
    omega = predict(known, wanted.angle, wanted.initial_angle).omega
    for body in over:
        if body.config is None:
            yield BodyHit(body.name, None, body.refusal)
            continue
        robot = RobotModel(body.config)
        try:
            stance = stance_for_step(robot, body.config.step.nominal, settings.com_inside_edge)
        except PostureUnreachable as error:
            yield BodyHit(body.name, None, str(error))
            continue
        middle, radius = stance.posture.elbow, body.config.contact_radius
        hinge = middle[:2] - np.array([settings.nominal_l_b, radius])
        contact = contact_with_leaf(middle, radius, hinge, wanted.initial_angle)
        yield BodyHit(body.name, plan_transfer(
            robot, known, wanted, settings, stance, contact, omega))


def table(hits: Iterable[BodyHit]) -> str:
    """The hits as a Markdown table with a row for each body."""
    lines = [
        "| what hits | v_rB [m/s] | m_re [kg] | apparent e | largest loads of gears, share of the "
        "momentary peak torque | pads [N], friction used | floor [N s] |",
        "| --- | --- | --- | --- | --- | --- | --- |"]
    for hit in hits:
        found = hit.transfer
        if found is None:
            lines.append(f"| {hit.name} | refused: {hit.refusal} | | | | | |")
            continue
        response = found.response
        loads = ", ".join(
            f"{load.joint} {abs(load.gear_torque):.0f} N m, {100 * load.share:.0f} %"
            for load in found.loads[:_LOADS])
        pads = "none"
        if response.pad_force > 0.0:
            pads = f"{response.pad_force:.0f}, {100 * response.pad_friction:.0f} %"
        lines.append(
            f"| {hit.name} | {found.speeds.v_rb:.3f} | {found.mass:.1f} | {found.restitution:.2f} "
            f"| {loads or 'joints are rigid'} | {pads} | {found.floor.impulse:.1f} |")
    return "\n".join(lines)


def hit_object(hit: BodyHit) -> dict[str, object]:
    """The figures of a hit for JSON."""
    found = hit.transfer
    if found is None:
        return {"body": hit.name, "refused": hit.refusal}
    response = found.response
    return {
        "body": hit.name, "v_rb": found.speeds.v_rb, "effective_mass": found.mass,
        "restitution": found.restitution,
        "gear_load": {load.joint: load.share for load in found.loads},
        "pad_force_n": response.pad_force, "pad_friction": response.pad_friction,
        "floor_impulse_ns": found.floor.impulse}


def build_parser() -> argparse.ArgumentParser:
    """Make the parser of the command's arguments."""
    parser = argparse.ArgumentParser(
        prog="hit_bodies",
        description="Compare what could hit the leaf: the configured braced posture, others that "
        "lean on the trunk, the free arm, other bodies of the robot. Print the speed that each "
        "needs and what it loads, by the planner's simulated hit.",
        epilog=_EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--door", default="paper", metavar="NAME_OR_YAML",
                        help=f"{', '.join(door_names())}, or a YAML file (default: %(default)s)")
    parser.add_argument("--angle-deg", type=float, default=25.0, metavar="DEG",
                        help="opening angle (default: %(default)s)")
    parser.add_argument("--robot", metavar="FILE.yaml", help="robot in the form of robot.yaml")
    parser.add_argument("--distances", nargs="*", type=float, default=_DISTANCES, metavar="M",
                        help="distances of the elbow from the middle of the robot (default: "
                        f"{' '.join(map(str, _DISTANCES))})")
    parser.add_argument("--links", nargs="*", default=_LINKS, metavar="LINK",
                        help="links that hit instead of the elbow (default: "
                        f"{' '.join(_LINKS)})")
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
        config = load_robot_config(options.robot)
        known = KnownDoor.configured(load_door(options.door))
        hits = list(compare(
            bodies(config, options.distances, options.links), known, PlannerSettings(),
            math.radians(options.angle_deg)))
    except DoorImpactError as error:
        print(f"hit_bodies: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(json.dumps({"door": known.name, "angle_deg": options.angle_deg,
                          "hits": list(map(hit_object, hits))}))
    else:
        print(table(hits))
    return 0


if __name__ == "__main__":
    sys.exit(main())
