"""What the driver's messages can be, for `Intake`."""

from __future__ import annotations

import numpy as np

from door_impact_common.arrays import Array
from door_impact_common.driver.intake import Plausible

_JOINT_RATE = 2.0  # largest plausible speed of a joint as a multiple of its limit
_JOINT_SLACK = 0.05  # change of a joint that is always plausible [rad]
_TILT_RATE = 6.0  # largest plausible rate of the trunk's tilt; a falling robot has some 3 [rad/s]
_TILT_SLACK = 0.1  # change of the tilt that is always plausible [rad]
_GYRO = 35.0  # largest angular velocity that a gyro of 2000 deg/s measures [rad/s]
_SPECIFIC_FORCE = 160.0  # largest specific force that an accelerometer of 16 g measures [m/s^2]

FORCE = Plausible(1e4)
"""Forces of the floor on a foot [N] and their moments [N m]."""

INERTIAL = Plausible((np.pi, *[_GYRO] * 3, *[_SPECIFIC_FORCE] * 3),
                     (_TILT_RATE, *[np.inf] * 6), _TILT_SLACK, longest=0.1)
"""Tilt of the trunk [rad], angular velocity [rad/s] and specific force [m/s^2]."""


def joint_ranges(speed_limit: Array) -> Plausible:
    """Return what positions, then speeds of joints can be.

    Args:
        speed_limit: Speed limits of the joints, (J,) [rad/s].
    """
    rates, free = _JOINT_RATE * speed_limit, np.full(len(speed_limit), np.inf)
    return Plausible(np.concatenate([free, rates]), np.concatenate([rates, free]), _JOINT_SLACK)
