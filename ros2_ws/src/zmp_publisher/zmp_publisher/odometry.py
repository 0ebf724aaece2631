"""Poses of base_link and of the soles in ``odom``, from joint angles and foot loads alone.

The sole that bears more load is assumed to lie flat and still on the floor; all other poses follow
from the joint angles. This is the leg odometry of a position-controlled humanoid: it does not
notice slip, or a sole that tilts about its edge while it bears load.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from humanoid_motion.kinematics import RobotKinematics, inverse_pose, planar_pose, yaw_of
from numpy.typing import ArrayLike

OTHER = {"left": "right", "right": "left"}


@dataclass(frozen=True)
class RobotPose:
    """Poses of base_link and of the soles in ``odom``.

    Attributes:
        base: Pose of base_link, (4, 4).
        soles: Poses of the ``left`` and ``right`` sole, (4, 4) each; a sole that bears load lies
            flat in z = 0.
        support: Side of the sole that is assumed not to move.
    """

    base: Array
    soles: Mapping[str, Array]
    support: str


class FootOdometry:
    """Leg odometry of a robot from foothold to foothold.

    The first sample in which a foot bears load defines ``odom``: its origin is on the floor midway
    between the soles' frames (below the ankles), its x axis has their mean heading.

    Args:
        kinematics: Kinematics of the robot.
        loaded_force: Normal force above which a sole is assumed to lie on the floor [N].
        hysteresis: Share of the load, in [0, 0.5). The other sole becomes the support when it
            bears more than the share 0.5 + hysteresis.

    Raises:
        SettingError: A setting is out of its range.
    """

    def __init__(
        self, kinematics: RobotKinematics, *, loaded_force: float, hysteresis: float = 0.05
    ) -> None:
        if not loaded_force > 0.0:
            raise SettingError("loaded_force", loaded_force, "positive")
        if not 0.0 <= hysteresis < 0.5:
            raise SettingError("hysteresis", hysteresis, "in [0, 0.5)")
        self._kinematics = kinematics
        self._loaded_force = loaded_force
        self._take_over = 0.5 + hysteresis
        self._support = ""
        self._anchor = np.eye(4)

    def reset(self) -> None:
        """Forget all footholds, so that the next loaded sample defines ``odom`` again."""
        self._support = ""

    def update(self, positions: ArrayLike, normal_force: Mapping[str, float]) -> RobotPose | None:
        """Compute the poses at the next sample.

        Args:
            positions: Joint angles in the robot's order, (J,) [rad].
            normal_force: Normal force of the floor on the ``left`` and ``right`` sole [N].

        Returns:
            The poses; None until a foot bears load for the first time.

        Raises:
            SettingError: The angles are not J finite numbers.
        """
        self._kinematics.set_joints(positions)
        in_base = self._kinematics.soles()
        loads = {side: max(float(normal_force[side]), 0.0) for side in OTHER}
        heavier = max(loads, key=lambda side: loads[side])
        if not loads[heavier] > self._loaded_force and not self._support:
            return None
        if not self._support:
            self._support = heavier
            self._anchor = _start(in_base[heavier], in_base[OTHER[heavier]])
        elif heavier != self._support and self._takes_over(loads, heavier):
            to_new = inverse_pose(in_base[self._support]) @ in_base[heavier]
            self._anchor = _flattened(self._anchor @ to_new)
            self._support = heavier
        base = self._anchor @ inverse_pose(in_base[self._support])
        other = OTHER[self._support]
        swing = base @ in_base[other]
        if loads[other] > self._loaded_force:
            swing = _flattened(swing)
        soles = {self._support: self._anchor.copy(), other: swing}
        return RobotPose(base, soles, self._support)

    def _takes_over(self, loads: Mapping[str, float], side: str) -> bool:
        return loads[side] > self._loaded_force and loads[side] > self._take_over * sum(
            loads.values()
        )


def _start(support: Array, other: Array) -> Array:
    """Pose of the supporting sole in the frame midway between both soles, from their poses."""
    relative = inverse_pose(support) @ other
    middle = planar_pose(relative[0, 3] / 2.0, relative[1, 3] / 2.0, yaw_of(relative) / 2.0)
    return inverse_pose(middle)


def _flattened(pose: Array) -> Array:
    """Pose at the same x, y and heading, but flat in z = 0."""
    return planar_pose(pose[0, 3], pose[1, 3], yaw_of(pose))
