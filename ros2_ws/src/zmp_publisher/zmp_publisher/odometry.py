"""Odometry of a robot that walks: poses of base_link and of the soles in ``odom``.

It needs joint angles and foot loads, and follows footholds: by `HeldSole` without an IMU, by
`WeightedSoles` with one. It does not notice a foot that slips.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from humanoid_motion.kinematics import inverse_pose, planar_pose, yaw_of
from humanoid_motion.mirror import OTHER
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample
from numpy.typing import ArrayLike
from robot_driver.foot_doubts import lifted, lying

from zmp_publisher.soles import HeldSole, RobotPose, WeightedSoles


class FootOdometry:
    """Odometry of a robot from foothold to foothold.

    The first sample in which a foot bears load defines ``odom``: there the middle between the
    soles' frames (below the ankles) is at the start pose, on the floor and in the soles' mean
    heading.

    IMU readings may begin and end at any time; the odometry then continues from where the soles
    are. A robot whose configuration has no `imu_frame` is followed without them.

    Args:
        loaded_force: Normal force above which a sole is assumed to lie on the floor [N].
        hysteresis: Share of the load, in [0, 0.5). The other sole becomes the support when it
            bears more than the share 0.5 + hysteresis.
        start: x [m], y [m] and heading [rad] of the middle between the soles at first, in ``odom``.

    Raises:
        SettingError: A setting is out of its range.
    """

    def __init__(
        self,
        robot: RobotModel,
        *,
        loaded_force: float,
        hysteresis: float = 0.05,
        start: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        if not loaded_force > 0.0:
            raise SettingError("loaded_force", loaded_force, "positive")
        if not 0.0 <= hysteresis < 0.5:
            raise SettingError("hysteresis", hysteresis, "in [0, 0.5)")
        if len(start) != 3 or not all(map(math.isfinite, start)):
            raise SettingError("start", start, "three finite numbers: x, y and heading")
        self._robot = robot
        self._loaded_force = loaded_force
        self._start = planar_pose(*start)
        self._imu_frame = robot.config.imu_frame
        rubber = robot.config.sole_rubber
        self._without_imu = HeldSole(loaded_force, 0.5 + hysteresis)
        self._with_imu = WeightedSoles(
            loaded_force, 0.5 + hysteresis, rubber.stiffness if rubber else math.inf)
        self._pose: RobotPose | None = None
        self._used_imu: bool | None = None

    @property
    def uses_imu(self) -> bool:
        """Whether the last poses followed from the IMU, too."""
        return bool(self._used_imu)

    @property
    def doubt(self) -> str:
        """Why the gyro is left out; empty while it is used."""
        return self._with_imu.doubt

    def reset(self) -> None:
        """Forget all footholds, so that the next loaded sample defines ``odom`` again."""
        self._pose, self._used_imu = None, None
        self._with_imu.doubt = ""

    def update(
        self,
        positions: ArrayLike,
        normal_force: Mapping[str, float],
        imu: ImuSample | None = None,
        time: float = 0.0,
    ) -> RobotPose | None:
        """Compute the poses at the next sample.

        Args:
            positions: Joint angles in the robot's order, (J,) [rad].
            normal_force: Normal force of the floor on the ``left`` and ``right`` sole [N].
            imu: Reading of the IMU, of which the heading is not used; None where there is none.
            time: Time of the reading [s]; without a reading it is not used.

        Returns:
            The poses; None until a foot bears load for the first time.

        Raises:
            SettingError: The angles are not J finite numbers.
        """
        angles, names = np.asarray(positions, dtype=float), self._robot.joint_names
        if angles.shape != (len(names),):
            raise SettingError("joint positions", angles.shape, f"shape ({len(names)},)")
        if not np.isfinite(angles).all():
            bad = int(np.argmin(np.isfinite(angles)))
            raise SettingError(names[bad], float(angles[bad]), "finite")
        frames = [self._robot.feet[side].frame for side in OTHER]
        if self._imu_frame is not None:
            frames.append(self._imu_frame)
        poses = self._robot.poses_in_base(angles, frames)
        in_base = dict(zip(OTHER, poses, strict=False))
        loads = {side: max(float(normal_force[side]), 0.0) for side in OTHER}
        if self._pose is None:
            heavier = max(loads, key=lambda side: loads[side])
            if not loads[heavier] > self._loaded_force:
                return None
            self._pose = self._first_pose(in_base, heavier)
        with_imu = imu is not None and self._imu_frame is not None
        if with_imu != self._used_imu:
            (self._with_imu if with_imu else self._without_imu).begin(self._pose)
            self._used_imu = with_imu
        vertical = poses[-1][:3, :3] @ imu.rotation[2] if imu is not None and with_imu else (
            in_base[self._pose.support][:3, 2])
        if air := lying(lifted(in_base, vertical), loads):
            loads[air] = 0.0  # what its sensor says is an offset
        if imu is not None and with_imu:
            self._pose = self._with_imu.update(in_base, loads, imu, poses[-1][:3, :3], time)
        else:
            self._pose = self._without_imu.update(in_base, loads)
        return self._pose

    def _first_pose(self, in_base: Mapping[str, Array], support: str) -> RobotPose:
        """Return the poses at the start, with the supporting sole flat on the floor."""
        relative = inverse_pose(in_base[support]) @ in_base[OTHER[support]]
        middle = planar_pose(relative[0, 3] / 2.0, relative[1, 3] / 2.0, yaw_of(relative) / 2.0)
        sole = self._start @ inverse_pose(middle)
        base = sole @ inverse_pose(in_base[support])
        return RobotPose(base, {side: base @ pose for side, pose in in_base.items()}, support)
