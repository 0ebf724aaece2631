"""Where base_link and the soles are in ``odom``, from joint angles and foot loads alone.

The sole that bears more is taken to lie flat and still on the floor; the legs tell the rest.
That is the leg odometry of a position-controlled humanoid: it knows nothing of slip, or of a sole
that tilts about its edge while it bears load.
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
    """Poses in ``odom`` (4, 4).

    Attributes:
        base: Of base_link.
        soles: Of the ``left`` and ``right`` sole; one that bears load lies flat in z = 0.
        support: The sole that is held fixed.
    """

    base: Array
    soles: Mapping[str, Array]
    support: str


class FootOdometry:
    """Follows the robot from foothold to foothold.

    ``odom`` is fixed by the first sample in which a foot bears load: origin on the floor midway
    between the soles' frames (under the ankles), x along their mean heading.

    Args:
        kinematics: Of the robot.
        loaded_force: Normal force above which a sole is taken to lie on the floor [N].
        hysteresis: The other sole takes over once it bears more than the share 0.5 + hysteresis
            of the load, in [0, 0.5).

    Raises:
        SettingError: If a setting is out of its range.
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
        """Forget everything: the next loaded sample fixes ``odom`` anew."""
        self._support = ""

    def update(self, positions: ArrayLike, normal_force: Mapping[str, float]) -> RobotPose | None:
        """Take the next sample.

        Args:
            positions: Joint angles (30,) [rad], in HRP-2's order.
            normal_force: Of the floor on the ``left`` and ``right`` sole [N].

        Returns:
            The robot's pose; None as long as no foot has ever borne load.

        Raises:
            SettingError: If the angles are not 30 finite numbers.
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
    """Pose of the supporting sole in the frame midway between both, from poses in base_link."""
    relative = inverse_pose(support) @ other
    middle = planar_pose(relative[0, 3] / 2.0, relative[1, 3] / 2.0, yaw_of(relative) / 2.0)
    return inverse_pose(middle)


def _flattened(pose: Array) -> Array:
    return planar_pose(pose[0, 3], pose[1, 3], yaw_of(pose))
