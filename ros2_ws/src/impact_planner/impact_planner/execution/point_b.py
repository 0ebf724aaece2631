"""Point B as joints and gyro tell it, with a sole at one place of the floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import needed
from hrp2_description.support import support_polygon
from humanoid_motion.robot_model import TOWARDS_DOOR, RobotModel
from numpy.typing import ArrayLike

STANDING_SIDE = "left"  # the foot that stays where it is during the whole motion


class PointB:
    """Kinematics of the elbow and the soles from joint angles and gyro, without odometry.

    base_link need not be level: the standing sole is.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._frame = robot.feet[STANDING_SIDE].frame
        self._imu = needed(robot.config.imu_frame, "imu_frame")

    def speed(self, position: Array, velocity: Array, rate: ArrayLike) -> float:
        """Speed of B towards the door [m/s].

        On soles that give way the robot also turns as a whole, about the standing sole.

        Args:
            position: Joint angles (30,) [rad].
            velocity: Joint speeds (30,) [rad/s].
            rate: Angular velocity in the IMU's frame (3,) [rad/s].
        """
        robot = self._robot
        q, v = robot.configuration(np.zeros(3), position), robot.velocity(np.zeros(3), velocity)
        sole_position, sole_rotation = robot.frame_pose(q, self._frame)
        sole_twist = robot.frame_jacobian(q, self._frame) @ v
        _, imu_rotation = robot.frame_pose(q, self._imu)
        base_rate = imu_rotation @ np.asarray(rate) - (robot.frame_jacobian(q, self._imu) @ v)[3:]
        arm = robot.contact_position(q) - sole_position
        relative = (robot.contact_jacobian(q) @ v - sole_twist[:3]
                    + np.cross(base_rate, arm))
        return float(np.array(TOWARDS_DOOR) @ (sole_rotation.T @ relative))

    def support_polygon(self, position: Array, sides: Sequence[str],
                        standing: ArrayLike) -> Array:
        """Hull of the soles that carry, as the joints place them.

        Args:
            position: Joint angles (30,) [rad].
            sides: Of the soles that carry.
            standing: x and y of the standing sole in odom (2,) [m].

        Returns:
            Corners (M, 2) in odom [m].
        """
        robot = self._robot
        q = robot.configuration(np.zeros(3), position)
        origin, rotation = robot.frame_pose(q, self._frame)
        corners = []
        for side in sides:
            sole, _ = robot.frame_pose(q, robot.feet[side].frame)
            place = (rotation.T @ (sole - origin))[:2] + np.asarray(standing, dtype=float)
            corners.append(robot.feet[side].corners(place))
        return support_polygon(*corners)
