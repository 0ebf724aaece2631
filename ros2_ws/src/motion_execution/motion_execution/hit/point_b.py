"""The speed of point B and the support polygon, from joints and gyro without odometry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import needed
from hrp2_description.support import support_polygon
from humanoid_motion.robot_model import TOWARDS_DOOR, RobotModel
from numpy.typing import ArrayLike

STANDING_SIDE = "left"  # side of the foot that stands still during the whole motion


class PointB:
    """Kinematics of the elbow and of the soles, seen from the sole that stands still.

    This sole is assumed to be level; base_link may be tilted.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._frame = robot.feet[STANDING_SIDE].frame
        self._imu = needed(robot.config.imu_frame, "imu_frame")

    def speed(self, position: Array, velocity: Array, rate: ArrayLike) -> float:
        """Calculate the speed of B towards the door [m/s].

        The whole robot also turns about the standing sole, because the soles are elastic. The gyro
        measures this turn.

        Args:
            position: Joint angles, (J,) [rad].
            velocity: Joint speeds, (J,) [rad/s].
            rate: Angular velocity in the IMU's frame, (3,) [rad/s].
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

    def away_from_door(self, position: Array) -> Array:
        """Return the horizontal unit vector away from the door in the IMU's frame, (3,).

        Args:
            position: Joint angles, (J,) [rad].
        """
        q = self._robot.configuration(np.zeros(3), position)
        _, sole_rotation = self._robot.frame_pose(q, self._frame)
        _, imu_rotation = self._robot.frame_pose(q, self._imu)
        away: Array = -(imu_rotation.T @ sole_rotation @ np.array(TOWARDS_DOOR))
        return away

    def reach(self, position: Array) -> float:
        """Calculate how far B is from the standing sole towards the door, of an upright robot [m].

        The trunk is upright rather than the sole level: rubber gives under the load.

        Args:
            position: Joint angles, (J,) [rad].
        """
        q = self._robot.configuration(np.zeros(3), position)
        return float(np.array(TOWARDS_DOOR) @ (
            self._robot.contact_position(q) - self._robot.frame_position(q, self._frame)))

    def support_polygon(self, position: Array, sides: Sequence[str],
                        standing: ArrayLike) -> Array:
        """Calculate the convex hull of the soles that carry the robot.

        Args:
            position: Joint angles, (J,) [rad].
            sides: Sides of the soles that carry the robot, "left" or "right".
            standing: x and y of the standing sole in odom, (2,) [m].

        Returns:
            Corners of the hull in odom, (M, 2) [m].
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
