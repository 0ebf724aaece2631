"""The whole body over given courses of the CoM and the feet.

Joints, base and their first two derivatives at a sample depend on the courses at that sample alone.
Therefore a walk that is planned anew from a state of an earlier plan joins that plan smoothly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.motion import BaseYaw, Motion
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import solve

from walking.pattern.course import Course, central

_STEP = 0.004  # step of the central differences [s]
# Largest error of the CoM [m]; the differences turn it into an error of the ZMP of 0.02 mm.
_TOLERANCE = 5e-9
WAIST_PER_COM = 1.166
"""Displacement of the waist per displacement of the CoM; 1.155 to 1.178 in walks of HRP-2."""


@dataclass(frozen=True)
class BodyCourses:
    """What determines a motion besides the CoM, at N samples.

    Attributes:
        feet: x, y, z [m] and yaw [rad] of each sole in odom, by side, (N, 4).
        waist: Height of base_link, (N,) [m].
        upper: Joints of the upper body in the robot's order, (N, J) [rad]; the legs' columns are
            ignored.
        chest_swing: Turn of the upper body per distance between the feet [rad/m].
    """

    feet: dict[str, Course]
    waist: Course
    upper: Course
    chest_swing: float


def whole_body(
    robot: RobotModel, time: Array, com: Course, body: BodyCourses, near: Course | None = None
) -> Motion:
    """Compute the motion of base and joints.

    The base's heading is the mean of the feet's. The upper body turns against the legs: its yaw
    joint follows the distance of the left foot ahead of the right one.

    Args:
        time: Times of the samples, (N,) [s].
        com: x and y of the CoM in odom, (N, 2) [m].
        body: Everything else.
        near: Nearly known x and y of base_link in odom, (N, 2) [m]; they shorten the search.

    Raises:
        PostureUnreachable: A leg does not reach.
    """
    feet = {side: body.feet[side].around(_STEP) for side in SIDES}  # (3, N, 4)
    yaw = 0.5 * (feet["left"][..., 3] + feet["right"][..., 3])
    upper = body.upper.around(_STEP)
    apart = feet["left"][..., :2] - feet["right"][..., :2]
    twist(robot, upper, body.chest_swing * feet_ahead(apart, yaw))
    targets = com.around(_STEP)
    guess = targets - _com_ahead(robot, yaw) if near is None else near.around(_STEP)

    def rows(values: Array) -> Array:
        return values.reshape(-1, *values.shape[2:])

    joints, base = solve(
        robot,
        upper=rows(upper),
        com_xy=rows(targets),
        waist_z=rows(body.waist.around(_STEP)),
        feet={side: rows(feet[side])[:, :3] for side in SIDES},
        near=rows(guess),
        tolerance=_TOLERANCE,
        waist_per_com=WAIST_PER_COM,
        base_yaw=rows(yaw),
        feet_yaw={side: rows(feet[side])[:, 3] for side in SIDES},
    )
    joint = central(joints.reshape(3, len(time), -1), _STEP)
    place = central(base.reshape(3, len(time), 3), _STEP)
    return Motion(time, *joint, *place, base_yaw=BaseYaw(*central(yaw, _STEP)))


def _com_ahead(robot: RobotModel, yaw: Array) -> Array:
    """Place of the CoM from base_link in half-sitting, in odom at headings (...), (..., 2) [m]."""
    x, y = robot.com(robot.configuration(np.zeros(3), robot.config.half_sitting))[:2]
    return np.stack([np.cos(yaw) * x - np.sin(yaw) * y, np.sin(yaw) * x + np.cos(yaw) * y], axis=-1)


def twist(robot: RobotModel, joints: Array, angle: Array) -> None:
    """Turn the upper body by angles (...) [rad] in joints (..., J) if the robot's chest turns."""
    if robot.config.chest_yaw is not None:
        joints[..., robot.config.index(robot.config.chest_yaw)] += angle


def feet_ahead(apart: Array, yaw: Array) -> Array:
    """Compute how far the left foot is ahead of the right one along a heading, (...) [m].

    Args:
        apart: x and y from the right to the left sole in odom, (..., 2) [m].
        yaw: Headings in odom, (...) [rad].
    """
    return np.asarray(np.cos(yaw) * apart[..., 0] + np.sin(yaw) * apart[..., 1])
