"""From where the robot stands to the state in which a walk begins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.kinematics import yaw_of
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.tolerances import STILL, WALK_START
from walking.errors import NotReady
from walking.footsteps.footstep import Pose, Stance
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState, resting, standing, untwisted

from motion_execution.judge import farthest

TILT = math.radians(3.0)  # largest tilt of the trunk at the beginning of a walk [rad]
LEVEL = 0.015  # largest difference in height of the soles [m]
FLAT = math.radians(3.0)  # largest tilt of a sole [rad]
NEAR = 0.03  # distance up to which the upper body counts as in half-sitting [rad]
_MISSES = 0.06  # by how much a measured posture may miss level soles [m, rad]


@dataclass(frozen=True)
class Standing:
    """What is known of a robot that stands.

    Attributes:
        base: Pose of base_link in odom by the odometry, as seen from above.
        tilt: Angle between base_link's z axis and the vertical [rad].
        position: Joint positions, (J,) [rad].
        velocity: Joint speeds, (J,) [rad/s].
        attitude: Orientation of the IMU as a quaternion x, y, z, w, (4,); None: not known.
    """

    base: Pose
    tilt: float
    position: Array
    velocity: Array
    attitude: Array | None = None


def start_state(
    robot: RobotModel, found: Standing, settings: WalkSettings, commanded: Array | None = None,
) -> WalkState:
    """Return the state in which a walk from the present posture begins.

    Motors never hold a posture exactly. So that many walks do not add up these errors, an upper
    body near half-sitting is taken to be in it; only another one, as after a hit, is kept as it was
    commanded, so that the driver's reference goes on without a jump.

    Args:
        found: What is known of the robot.
        commanded: Posture in which the last trajectory ends, (J,) [rad]; None, and one that the
            robot is not in, stand for the measured one.

    Raises:
        NotReady: The robot moves, is tilted, or does not stand flat on both feet.
        HumanoidMotionError: The legs cannot take this posture with an upright trunk.
    """
    _require(found.tilt, TILT, "tilt of the trunk [rad]", "has the robot fallen?")
    name, speed = farthest(found.velocity, np.zeros_like(found.velocity), robot.joint_names)
    _require(speed, STILL, f"speed of {name} [rad/s]", "a walk begins at rest")
    stance, height = _feet(robot, found)
    plain = standing(robot, stance)
    upper = untwisted(robot, stance, found.position, settings)
    if robot.folded_by(upper) <= NEAR and abs(height - plain.waist_height) <= LEVEL:
        return plain
    held = found.position
    if commanded is not None and np.abs(held - commanded).max() <= WALK_START:
        held = commanded
    return resting(robot, stance, held, settings, _MISSES)


def require_near(robot: RobotModel, first: Array, position: Array) -> None:
    """Check that the robot is near the first posture of a walk.

    Args:
        first: Joint positions at the beginning of the walk, (J,) [rad].
        position: Present joint positions, (J,) [rad].

    Raises:
        NotReady: A joint is too far away.
    """
    name, off = farthest(position, first, robot.joint_names)
    _require(off, WALK_START,
             f"distance of {name} from the walk's first posture [rad]",
             "the robot is not in a posture from which it can walk")


def soles_at(
    robot: RobotModel, base: Pose, position: Array, attitude: Array | None = None
) -> Stance:
    """Compute where the soles are, as seen from above.

    A robot that leans on a leaf has them 10 mm for each degree away from where an upright one has.

    Args:
        base: Pose of base_link in odom, as seen from above.
        position: Joint positions, (J,) [rad].
        attitude: Orientation of the IMU as a quaternion x, y, z, w, (4,); None takes the robot as
            upright, as one without `imu_frame`.
    """
    imu = robot.config.imu_frame
    frames = [robot.feet[side].frame for side in SIDES]
    *poses, in_base = robot.poses_in_base(position, [*frames, imu or frames[0]])
    turn = np.eye(3)
    if attitude is not None and imu is not None:
        turn = pin.Quaternion(attitude).matrix() @ in_base[:3, :3].T
    seen = base.moved(0.0, 0.0, -yaw_of(turn))
    turned = [(turn @ pose[:3, 3], yaw_of(turn @ pose[:3, :3])) for pose in poses]
    return Stance(*(seen.moved(float(place[0]), float(place[1]), yaw) for place, yaw in turned))


def _feet(robot: RobotModel, found: Standing) -> tuple[Stance, float]:
    """Return the soles on the floor, and the height of base_link above them [m].

    Raises:
        NotReady: A sole is not flat, or they are not equally high.
    """
    frames = [robot.feet[side].frame for side in SIDES]
    poses = robot.poses_in_base(found.position, frames)
    for side, pose in zip(SIDES, poses, strict=True):
        lean = math.acos(min(1.0, max(-1.0, float(pose[2, 2]))))
        _require(lean, FLAT, f"tilt of the {side} sole [rad]", "the robot does not stand")
    heights = [-float(pose[2, 3]) for pose in poses]
    _require(abs(heights[0] - heights[1]), LEVEL, "difference in height of the soles [m]",
             "the robot does not stand on both feet")
    soles = soles_at(robot, found.base, found.position, found.attitude)
    return soles, float(np.mean(heights))


def _require(value: float, limit: float, quantity: str, what: str) -> None:
    if not value <= limit:  # also NaN
        raise NotReady(f"{what}: the {quantity} is {value:.3f}, at most {limit:.3f} are allowed",
                       quantity=quantity, value=float(value), limit=limit)
