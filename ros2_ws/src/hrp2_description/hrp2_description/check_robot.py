"""Command `ros2 run hrp2_description check_robot`: what a robot.yaml and its URDF describe."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping, Sequence

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.files import run_command

from hrp2_description.robot import RobotConfig, load_robot_config
from hrp2_description.urdf import Urdf

_EXAMPLE = """\
example, a file beside its URDF; planner, motion server, ZMP and simulation refuse what this
command refuses:
  ros2 run hrp2_description check_robot my_robot.yaml
"""


def main(args: Sequence[str] | None = None) -> int:
    """Run the command, and return its exit code: 1 for a robot that is refused."""
    parser = argparse.ArgumentParser(
        prog="check_robot", epilog=_EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Print what a robot.yaml and its URDF describe, and what is improbable in it.")
    parser.add_argument("robot", nargs="?", metavar="YAML", help="robot.yaml (default: HRP-2's)")
    options = parser.parse_args(args)
    return run_command("check_robot", lambda: _text(load_robot_config(options.robot)))


def _text(robot: RobotConfig) -> str:
    urdf = Urdf(robot.urdf_path)
    standing = _places(urdf, robot, robot.half_sitting)
    braced = _places(urdf, robot, robot.posture(robot.braced_posture))
    floor = standing[robot.feet["left"].sole][2]
    top = max(standing, key=lambda link: float(standing[link][2]))
    children = {joint: child for joint, _, child in urdf.tree}
    arm = [standing[link] for link in (
        *(children[joint] for joint in robot.arm.joints), robot.hand_link)]
    reach = float(np.linalg.norm(np.diff(arm, axis=0), axis=1).sum())
    lines = [
        f"{robot.name}: {robot.mass:.2f} kg in {len(urdf.links)} links, {len(robot.joint_names)} "
        f"moving joints; {robot.urdf_file}",
        f"half-sitting: {standing[top][2] - floor:.3f} m high up to {top}; braced elbow "
        f"{braced[robot.contact_link][2] - floor:.3f} m above the floor",
        f"reach: the hand up to {reach:.3f} m from the shoulder; the hit with "
        f"{robot.contact_link}, radius {robot.contact_radius:.3f} m",
        f"{'joint':<20}{'lower':>8}{'upper':>8} deg {'speed':>8} rad/s {'torque':>8} N m",
    ]
    lines += [
        f"{name:<20}{lower:8.1f}{upper:8.1f}     {speed:8.2f}       {effort:8.1f}"
        for name, lower, upper, speed, effort in zip(
            robot.joint_names, np.degrees(robot.lower), np.degrees(robot.upper),
            robot.velocity_limit, robot.effort_limit, strict=True)]
    return "\n".join([*lines, *(f"doubt: {doubt}" for doubt in robot.doubts or ("none",))])


def _places(urdf: Urdf, robot: RobotConfig, posture: Array) -> Mapping[str, Array]:
    """Return the origins of all links in the axes of the base, (3,) [m], by the links' names."""
    angles = dict(zip(robot.joint_names, posture, strict=True))
    poses = {link: (np.zeros(3), np.eye(3)) for link in urdf.links}
    for joint, parent, child in urdf.tree:
        place, turn = poses[parent]
        xyz, (roll, pitch, yaw), axis = urdf.frame(joint)
        mounted = turn @ _turn("001", yaw) @ _turn("010", pitch) @ _turn("100", roll)
        poses[child] = place + turn @ xyz, mounted @ _turn(axis, angles.get(joint, 0.0))
    return {link: place for link, (place, _) in poses.items()}


def _turn(axis: Sequence[float] | str, angle: float) -> Array:
    """Return the rotation about an axis of length 1 by an angle [rad], (3, 3)."""
    x, y, z = map(float, axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Array = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    return turn


if __name__ == "__main__":
    sys.exit(main())
