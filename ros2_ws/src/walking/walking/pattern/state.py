"""The state from which a walk is planned: at rest, or where an earlier walk begins a step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import solve

from walking.footsteps.footstep import Stance
from walking.pattern.preview import CartState
from walking.pattern.zmp_reference import rest_point


@dataclass(frozen=True)
class WalkState:
    """Reference state of the robot at rest or at the beginning of a double support.

    Feet, base yaw and chest follow from the stance.

    Attributes:
        stance: The soles.
        cart: CoM and controller of the preview control on the reference.
        correction: CoM and controller of the preview control on the error of the cart's ZMP; its
            CoM adds to that of `cart`.
        zmp: Reference of the ZMP, (2,) [m].
        waist_height: Height of base_link [m].
        upper: Joints in the robot's order, of which those of the upper body count, (J,) [rad].
        joints: Reference of all joints, (J,) [rad].
        at_rest: Whether the robot stands still.
    """

    stance: Stance
    cart: CartState
    correction: CartState
    zmp: Array
    waist_height: float
    upper: Array
    joints: Array
    at_rest: bool

    @property
    def com(self) -> Array:
        """Position, velocity and acceleration of the CoM, (3, 2) [m, m/s, m/s^2]."""
        return self.cart.com + self.correction.com


def rest_height(robot: RobotModel) -> float:
    """Compute the height of base_link above the floor in half-sitting [m]."""
    q = robot.configuration(np.zeros(3), robot.config.half_sitting)
    return -float(robot.frame_position(q, robot.feet["right"].frame)[2])


def standing(robot: RobotModel, stance: Stance, upper: Array | None = None) -> WalkState:
    """Return the state of a robot that stands still as high as in half-sitting.

    Args:
        robot: The robot.
        stance: The soles.
        upper: Joints of which those of the upper body count, (J,) [rad]; the default is
            half-sitting.

    Raises:
        PostureUnreachable: A leg does not reach its sole.
    """
    chosen = np.array(robot.config.half_sitting if upper is None else upper, dtype=float)
    com, height = rest_point(robot, stance), rest_height(robot)
    yaw = stance.middle.yaw
    joints, _ = solve(
        robot, upper=chosen, com_xy=com, waist_z=height,
        feet={side: np.array([*stance.foot(side)[:2], 0.0]) for side in ("left", "right")},
        base_yaw=yaw, feet_yaw={side: stance.foot(side).yaw for side in ("left", "right")})
    return WalkState(
        stance, CartState.at_rest(com), CartState.at_rest(np.zeros(2)), com, height, chosen,
        joints[0], at_rest=True)
