"""The state from which a walk is planned: at rest, or where an earlier walk begins a step."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel

from walking.errors import WalkInfeasible
from walking.footsteps.footstep import Pose, Stance, as_array, wrapped
from walking.pattern.course import Course, to_rest
from walking.pattern.preview import CartState
from walking.pattern.settings import WalkSettings
from walking.pattern.timing import rest_point
from walking.pattern.whole_body import feet_ahead, twist

_UPPER = 0.4  # time in which a moving upper body comes to rest [s]
_GOES_ON = 0.4  # way that it goes on meanwhile, as a share of that at its present speed
_RESERVE = 0.02  # distance from the ends of the joints' ranges in which it comes to rest [rad]
_FITS = 1e-3  # by how much a posture may miss the soles [m, rad]


@dataclass(frozen=True)
class WalkState:
    """Reference state of the robot at rest or at the beginning of a double support.

    Heading of the base and twist of the chest follow from the stance, and so the joints' reference
    does.

    Attributes:
        stance: The soles.
        cart: CoM and controller of the preview control on the reference.
        correction: CoM and controller of the preview control on the error of the cart's ZMP; its
            CoM adds to that of `cart`.
        zmp: Reference of the ZMP, (2,) [m].
        waist_height: Height of base_link [m].
        upper: Joints in the robot's order, of which those of the upper body count, without the
            twist of the chest, with their derivatives, (J,) each [rad].
        at_rest: Whether the legs stand still.
        hand_force: Force of the surroundings on the hand, axes of odom, (3,) [N].
    """

    stance: Stance
    cart: CartState
    correction: CartState
    zmp: Array
    waist_height: float
    upper: Course
    at_rest: bool
    hand_force: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def com(self) -> Array:
        """Position, velocity and acceleration of the CoM, (3, 2) [m, m/s, m/s^2]."""
        return self.cart.com + self.correction.com


def standing(robot: RobotModel, stance: Stance, upper: Array | None = None) -> WalkState:
    """Return the state in which every walk ends: at rest, as high as in half-sitting.

    Args:
        upper: Joints of which those of the upper body count, (J,) [rad]; the default is
            half-sitting.
    """
    chosen = np.array(robot.config.half_sitting if upper is None else upper, dtype=float)
    return _resting(stance, rest_point(robot, stance), robot.standing_height, chosen)


def resting(
    robot: RobotModel, stance: Stance, joints: Array, settings: WalkSettings,
    fits: float = _FITS,
) -> WalkState:
    """Return the state of a robot that stands still in a posture, for instance after a hit.

    Args:
        joints: All joints, (J,) [rad].
        settings: Settings of the walk that begins there.
        fits: By how much the posture may miss the soles [m, rad]; measured postures do.

    Raises:
        WalkInfeasible: The posture does not put the soles where they are, or the base does not
            point in their mean heading.
    """
    upper = np.array(joints, dtype=float)
    q = robot.configuration(np.zeros(3), upper)
    (left, turn), (right, _) = (robot.frame_pose(q, robot.feet[side].frame) for side in SIDES)
    yaw = stance.middle.yaw
    base = Pose(0.0, 0.0, yaw).moved(float(left[0]), float(left[1]))
    place = np.array([stance.left.x - base.x, stance.left.y - base.y, -left[2]])
    other = Pose(float(place[0]), float(place[1]), yaw).moved(float(right[0]), float(right[1]))
    off = max(
        math.hypot(other.x - stance.right.x, other.y - stance.right.y), abs(right[2] - left[2]),
        abs(wrapped(yaw + math.atan2(turn[1, 0], turn[0, 0]) - stance.left.yaw)),
        float(np.abs(turn[2, :2]).max()))
    if not off <= fits:
        raise WalkInfeasible(
            f"the posture does not fit the soles: they are off by {off:.4f} m or rad, "
            f"{fits:g} are allowed",
            quantity="posture of the legs [m, rad]", value=off, limit=fits)
    q = robot.configuration(place, upper)
    q[5], q[6] = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
    return _resting(
        stance, robot.com(q)[:2], float(place[2]), untwisted(robot, stance, upper, settings))


def untwisted(
    robot: RobotModel, stance: Stance, joints: Array, settings: WalkSettings
) -> Array:
    """Return joints (J,) [rad] without the twist of the chest that a walk has on a stance."""
    upper = np.array(joints, dtype=float)
    twist(robot, upper, -settings.chest_swing * feet_ahead(
        as_array(stance.left)[:2] - as_array(stance.right)[:2], np.array(stance.middle.yaw)))
    return upper


def _resting(stance: Stance, com: Array, height: float, upper: Array) -> WalkState:
    return WalkState(
        stance, CartState.at_rest(com), CartState.at_rest(np.zeros(2)), com, height,
        Course(upper, np.zeros_like(upper), np.zeros_like(upper)), at_rest=True)


def resting_upper(robot: RobotModel, begin: Course, time: Array) -> Course:
    """Compute how the upper body comes to rest: it goes on in its direction, within its ranges.

    Args:
        begin: Joints at time 0 with their derivatives, (J,) each [rad].
        time: Times, (N,) [s].
    """
    end = (begin.value + _GOES_ON * _UPPER * begin.speed).clip(
        robot.lower + _RESERVE, robot.upper - _RESERVE)
    return to_rest(begin, np.where(begin.speed != 0.0, end, begin.value), _UPPER, time)
