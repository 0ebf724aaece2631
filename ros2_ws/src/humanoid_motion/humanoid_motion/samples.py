"""What a driver measures, without ROS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array


@dataclass(frozen=True)
class ImuSample:
    """Reading of an IMU.

    Attributes:
        orientation: Quaternion x, y, z, w of the IMU's frame in the world, (4,).
        angular_velocity: Angular velocity in the IMU's frame, (3,) [rad/s].
        specific_force: Acceleration minus gravity in the IMU's frame, (3,) [m/s^2]; at rest it
            points upward with the length g. Zeros mean that there is no accelerometer.
    """

    orientation: Array
    angular_velocity: Array
    specific_force: Array

    @property
    def rotation(self) -> Array:
        """Rotation of the IMU's frame in the world, (3, 3)."""
        return np.asarray(pin.Quaternion(self.orientation).normalized().matrix())


NO_IMU = ImuSample(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3))
"""Stands for the reading of an IMU that is silent."""


@dataclass(frozen=True)
class Measured:
    """What was measured at one time; joints are in the robot's order.

    Attributes:
        position: Joint positions, (J,) [rad].
        velocity: Joint velocities, (J,) [rad/s].
        imu: Reading of the IMU.
        left_wrench: Force and torque of the floor on the left sole, in l_sole, (6,) [N, N m].
        right_wrench: The same of the right sole.
        time: Stamp [s].
    """

    position: Array
    velocity: Array
    imu: ImuSample
    left_wrench: Array
    right_wrench: Array
    time: float


@dataclass(frozen=True)
class Doubt:
    """A contradiction between a sensor and what is known of the robot.

    Attributes:
        topic: Topic of the sensor.
        text: Sentence with the value and the limit.
        value: The value.
        grave: Whether a motion would rest on what is wrong, and must not begin.
    """

    topic: str
    text: str
    value: float
    grave: bool
