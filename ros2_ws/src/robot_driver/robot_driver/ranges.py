"""What the driver's messages can be, for `Intake`."""

from __future__ import annotations

import numpy as np
from humanoid_motion.robot_model import RobotModel

from robot_driver.intake import Plausible

_JOINT_OVER = 0.3  # by how much a joint can be measured beyond its range [rad]
_JOINT_RATE = 2.0  # largest plausible speed of a joint as a multiple of its limit
_JOINT_SLACK = 0.05  # change of a joint that is always plausible [rad]
_TILT_RATE = 6.0  # largest plausible rate of the base's tilt; a falling robot has some 3 [rad/s]
_TILT_SLACK = 0.1  # change of the tilt that is always plausible [rad]
_DOOR_RATE = 6.0  # largest plausible speed of the door [rad/s]
_DOOR_SLACK = 0.02  # change of the door's angle that is always plausible [rad]
_GYRO = 35.0  # largest angular velocity that a gyro of 2000 deg/s measures [rad/s]
_SPECIFIC_FORCE = 160.0  # largest specific force that an accelerometer of 16 g measures [m/s^2]

DOOR_ANGLE = Plausible((np.inf, _DOOR_RATE), (_DOOR_RATE, np.inf), _DOOR_SLACK)
"""Angle [rad] and angular velocity [rad/s] of the door."""

FORCE = Plausible(1e4)
"""Forces of the surroundings on a foot or a hand [N] and their moments [N m]."""

INERTIAL = Plausible((np.pi, *[_GYRO] * 3, *[_SPECIFIC_FORCE] * 3),
                     (_TILT_RATE, *[np.inf] * 6), _TILT_SLACK, longest=0.1,
                     names=("tilt [rad]", *["angular velocity [rad/s]"] * 3,
                            *["specific force [m/s^2]"] * 3))
"""Tilt of the base [rad], angular velocity [rad/s] and specific force [m/s^2]."""


def joint_ranges(robot: RobotModel) -> Plausible:
    """Return what positions, then speeds of a robot's joints can be."""
    names = robot.joint_names
    reach = np.maximum(np.abs(robot.lower), np.abs(robot.upper)) + _JOINT_OVER
    rates, free = _JOINT_RATE * robot.speed_limit, np.full(len(names), np.inf)
    return Plausible(
        np.concatenate([reach, rates]), np.concatenate([rates, free]), _JOINT_SLACK,
        names=[*(f"{name} [rad]" for name in names),
               *(f"speed of {name} [rad/s]" for name in names)])
