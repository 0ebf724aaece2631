"""Geometry of the brace: where the arm's pad stands to the trunk's pad, and how joints move it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.drives_and_pads import Brace

from humanoid_motion.robot_model import RobotModel

TANGENTIAL = 0.5  # tangential stiffness and damping of the pads as a share of the normal ones


@dataclass(frozen=True)
class PadContact:
    """The arm's ball in front of the trunk's disc in one configuration.

    Attributes:
        axes: Unit normal of the disc and two tangents as rows, axes of odom, (3, 3).
        offset: Place of the ball's nearest point relative to the disc's middle along these axes,
            (3,) [m]; a negative first entry is the depth to which the pads are pressed.
        jacobian: Velocity of the ball's material at that place relative to the trunk's, along
            these axes, by Pinocchio's velocity, (3, nv). A force between the pads does its work
            along it.
        disc: Radius of the disc [m].
    """

    axes: Array
    offset: Array
    jacobian: Array
    disc: float

    @property
    def beside(self) -> float:
        """Distance of the ball's middle outside the disc's edge [m]; negative on the disc."""
        return float(np.hypot(*self.offset[1:])) - self.disc


def pad_contact(robot: RobotModel, q: Array, brace: Brace) -> PadContact:
    """Compute how the pads of a brace stand to each other.

    Args:
        q: Configuration.
        brace: Its pads.
    """
    (arm, arm_turn), (trunk, turn) = (
        robot.frame_pose(q, pad.link) for pad in (brace.arm, brace.trunk))
    ball = arm + arm_turn @ np.array(brace.arm.place)
    middle = trunk + turn @ np.array(brace.trunk.place)
    axes = normal_and_tangents(np.array(brace.normal)) @ turn.T
    # Both Jacobians are those of the point where the ball touches.
    point = ball - brace.arm.size * axes[0]
    frames = robot.frames_at(q, [brace.arm.link, brace.trunk.link])
    moves = [twist[:3] - pin.skew(point - place) @ twist[3:] for place, twist in frames]
    return PadContact(
        axes, axes @ (point - middle), axes @ (moves[0] - moves[1]), brace.trunk.size)


def normal_and_tangents(normal: Array) -> Array:
    """Compute a rotation (3, 3) whose first row is a unit vector (3,), the others its tangents."""
    aside = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(normal, aside)
    first /= np.linalg.norm(first)
    return np.stack([normal, first, np.cross(normal, first)])
