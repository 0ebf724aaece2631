"""Odometry without an IMU: the sole that bears more load lies flat and still on the floor.

All other poses follow from the joint angles. This takes a sole on rubber, which tilts by some
degrees while it bears the robot alone, for level.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.kinematics import inverse_pose, planar_pose, yaw_of

from zmp_publisher.robot_pose import OTHER, RobotPose, next_support


class HeldSole:
    """Follows a robot by the one sole that is assumed not to move.

    Args:
        loaded_force: Normal force above which a sole is assumed to lie on the floor [N].
        take_over: Share of the load above which the other sole becomes the held one.
    """

    def __init__(self, loaded_force: float, take_over: float) -> None:
        self._loaded_force = loaded_force
        self._take_over = take_over
        self._support = "left"
        self._anchor = np.eye(4)

    def begin(self, pose: RobotPose) -> None:
        """Continue from a pose."""
        self._support = pose.support
        self._anchor = _flattened(pose.soles[pose.support])

    def update(self, in_base: Mapping[str, Array], loads: Mapping[str, float]) -> RobotPose:
        """Compute the poses at the next sample.

        Args:
            in_base: Pose of each sole in base_link, (4, 4).
            loads: Normal force on each sole, not negative [N].
        """
        support = next_support(self._support, loads, self._loaded_force, self._take_over)
        if support != self._support:
            to_new = inverse_pose(in_base[self._support]) @ in_base[support]
            self._anchor = _flattened(self._anchor @ to_new)
            self._support = support
        base = self._anchor @ inverse_pose(in_base[support])
        other = OTHER[support]
        swing = base @ in_base[other]
        if loads[other] > self._loaded_force:
            swing = _flattened(swing)
        return RobotPose(base, {support: self._anchor.copy(), other: swing}, support)


def _flattened(pose: Array) -> Array:
    """Pose at the same x, y and heading, but flat in z = 0."""
    return planar_pose(pose[0, 3], pose[1, 3], yaw_of(pose))
