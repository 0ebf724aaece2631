"""Poses on the floor, footsteps, and the stance on two feet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES

OUTWARD = {"left": 1.0, "right": -1.0}
"""Sign of y towards a foot's outer side."""


class Pose(NamedTuple):
    """A pose on the floor in odom.

    Attributes:
        x: Position along odom's x [m].
        y: Position along odom's y [m].
        yaw: Heading, the turn about z [rad].
    """

    x: float
    y: float
    yaw: float

    def moved(self, x: float, y: float, yaw: float = 0.0) -> Pose:
        """Return the pose that lies at x, y [m] and yaw [rad] in the axes of this one."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(self.x + cos * x - sin * y, self.y + sin * x + cos * y, self.yaw + yaw)

    def seen_from(self, other: Pose) -> Pose:
        """Return this pose in the axes of another one, with a yaw within half a turn [m, rad]."""
        cos, sin = math.cos(other.yaw), math.sin(other.yaw)
        x, y = self.x - other.x, self.y - other.y
        return Pose(cos * x + sin * y, cos * y - sin * x, wrapped(self.yaw - other.yaw))


ORIGIN = Pose(0.0, 0.0, 0.0)
"""The origin of odom, where a hit begins."""


def wrapped(angle: float) -> float:
    """Return an angle within half a turn, from -pi to pi [rad]."""
    return math.remainder(angle, 2.0 * math.pi)


def other(side: str) -> str:
    """Return the opposite side."""
    return SIDES[1 - SIDES.index(side)]


@dataclass(frozen=True)
class Footstep:
    """A step of one foot.

    Attributes:
        side: Foot that steps, ``"left"`` or ``"right"``.
        x: x of the sole's frame in odom after the step [m].
        y: y of the sole's frame in odom after the step [m].
        yaw: Heading of the sole in odom after the step [rad].
        duration: Time of the step, double support and single support together [s].
    """

    side: str
    x: float
    y: float
    yaw: float
    duration: float = 0.8

    @property
    def pose(self) -> Pose:
        """Pose of the sole after the step."""
        return Pose(self.x, self.y, self.yaw)


@dataclass(frozen=True)
class Stance:
    """Poses of both soles on the floor.

    Attributes:
        left: Pose of the left sole's frame in odom.
        right: Pose of the right sole's frame in odom.
    """

    left: Pose
    right: Pose

    @classmethod
    def around(cls, middle: Pose, width: float) -> Stance:
        """Return the stance with parallel feet beside each other.

        Args:
            middle: Pose of the middle between the soles.
            width: Distance between the soles' frames [m].
        """
        return cls(middle.moved(0.0, 0.5 * width), middle.moved(0.0, -0.5 * width))

    def foot(self, side: str) -> Pose:
        """Return the pose of one sole."""
        return self.left if side == "left" else self.right

    @property
    def middle(self) -> Pose:
        """Pose of the middle between the soles, with their mean heading."""
        return Pose(
            0.5 * (self.left.x + self.right.x), 0.5 * (self.left.y + self.right.y),
            self.left.yaw + 0.5 * wrapped(self.right.yaw - self.left.yaw))

    def after(self, step: Footstep) -> Stance:
        """Return the stance after a footstep."""
        if step.side == "left":
            return Stance(step.pose, self.right)
        return Stance(self.left, step.pose)


def stances(stance: Stance, footsteps: Sequence[Footstep]) -> list[Stance]:
    """Return the stance before the first footstep and after each one, N + 1 of them."""
    found = [stance]
    for step in footsteps:
        found.append(found[-1].after(step))
    return found


def as_array(pose: Pose) -> Array:
    """Return x, y and yaw as an array, (3,) [m, m, rad]."""
    return np.array([pose.x, pose.y, pose.yaw])
