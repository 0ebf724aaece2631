"""From where the robot stands to the state in which a walk begins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel

from walking.errors import NotReady
from walking.footsteps.footstep import Pose, Stance
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState, resting, standing, untwisted

TILT = math.radians(3.0)  # largest tilt of the trunk at the beginning of a walk [rad]
LEVEL = 0.015  # largest difference in height of the soles [m]
FLAT = math.radians(3.0)  # largest tilt of a sole [rad]
NEAR = 0.03  # distance up to which the upper body counts as in a known posture [rad]
JOINT = 0.08  # largest distance of a joint from the first posture of the walk [rad]
_MISSES = 0.06  # by how much a measured posture may miss level soles [m, rad]
STILL = 0.2  # largest speed of a joint at the beginning of a walk [rad/s]


@dataclass(frozen=True)
class Standing:
    """What is known of a robot that stands.

    Attributes:
        base: Pose of base_link in odom by the odometry, as seen from above.
        tilt: Angle between the trunk and the vertical [rad].
        position: Joint positions, (J,) [rad].
        velocity: Joint speeds, (J,) [rad/s].
    """

    base: Pose
    tilt: float
    position: Array
    velocity: Array


def start_state(
    robot: RobotModel, found: Standing, settings: WalkSettings, known: Sequence[Array] = (),
) -> WalkState:
    """Return the state in which a walk from the present posture begins.

    Motors never hold a posture exactly. So that many walks do not add up these errors, an upper
    body near a known posture is taken to be in it; only another one, as after a hit, is kept as it
    is measured.

    Args:
        robot: The robot.
        found: What is known of the robot.
        settings: Settings of the walk.
        known: Postures that the upper body may have been commanded to, (J,) each [rad]; the legs'
            columns are ignored. Half-sitting is always one of them.

    Raises:
        NotReady: The robot moves, is tilted, or does not stand flat on both feet.
        HumanoidMotionError: The legs cannot take this posture with an upright trunk.
    """
    _require_still(robot, found)
    stance, height = _feet(robot, found)
    trunk = np.ones(len(found.position), dtype=bool)
    for columns in robot.leg_columns.values():
        trunk[list(columns)] = False
    plain = standing(robot, stance)
    upper = untwisted(robot, stance, found.position, settings)
    near = [posture for posture in (*known, robot.config.half_sitting)
            if np.abs(upper - posture)[trunk].max() <= NEAR]
    if near and abs(height - plain.waist_height) <= LEVEL:
        return standing(robot, stance, near[0])
    return resting(robot, stance, found.position, settings, _MISSES)


def require_near(robot: RobotModel, first: Array, position: Array) -> None:
    """Check that the robot is near the first posture of a walk.

    Args:
        robot: The robot.
        first: Joint positions at the beginning of the walk, (J,) [rad].
        position: Present joint positions, (J,) [rad].

    Raises:
        NotReady: A joint is too far away.
    """
    off = np.abs(position - first)
    worst = int(np.argmax(off))
    if off[worst] > JOINT:
        raise NotReady(
            f"the robot is not in a posture from which it can walk: {robot.joint_names[worst]} is "
            f"{off[worst]:.3f} rad from the first posture of the walk, at most {JOINT} rad are "
            "allowed", quantity=f"{robot.joint_names[worst]} [rad]", value=float(off[worst]),
            limit=JOINT)


def _require_still(robot: RobotModel, found: Standing) -> None:
    if not found.tilt <= TILT:
        raise NotReady(
            f"the trunk is tilted by {math.degrees(found.tilt):.1f} deg, a walk begins at no more "
            f"than {math.degrees(TILT):.1f} deg: has the robot fallen?",
            quantity="tilt [rad]", value=found.tilt, limit=TILT)
    speed = np.abs(found.velocity)
    fastest = int(np.argmax(speed))
    if not speed[fastest] <= STILL:
        raise NotReady(
            f"{robot.joint_names[fastest]} turns at {speed[fastest]:.2f} rad/s; a walk begins at "
            f"rest, with at most {STILL:g} rad/s",
            quantity=f"{robot.joint_names[fastest]} [rad/s]", value=float(speed[fastest]),
            limit=STILL)


def _feet(robot: RobotModel, found: Standing) -> tuple[Stance, float]:
    """Return the soles on the floor, and the height of base_link above them [m].

    Raises:
        NotReady: A sole is not flat, or they are not equally high.
    """
    q = robot.configuration(np.zeros(3), found.position)
    poses, heights = {}, []
    for side in SIDES:
        place, turn = robot.frame_pose(q, robot.feet[side].frame)
        lean = math.acos(min(1.0, max(-1.0, float(turn[2, 2]))))
        if lean > FLAT:
            raise NotReady(
                f"the {side} sole leans by {math.degrees(lean):.1f} deg, at most "
                f"{math.degrees(FLAT):.1f} deg are allowed: the robot does not stand",
                quantity=f"{side} sole [rad]", value=lean, limit=FLAT)
        yaw = math.atan2(float(turn[1, 0]), float(turn[0, 0]))
        poses[side] = found.base.moved(float(place[0]), float(place[1]), yaw)
        heights.append(-float(place[2]))
    apart = abs(heights[0] - heights[1])
    if apart > LEVEL:
        raise NotReady(
            f"one sole is {1e3 * apart:.0f} mm higher than the other, at most {1e3 * LEVEL:.0f} mm "
            "are allowed: the robot does not stand on both feet",
            quantity="height of the soles [m]", value=apart, limit=LEVEL)
    return Stance(**poses), float(np.mean(heights))
