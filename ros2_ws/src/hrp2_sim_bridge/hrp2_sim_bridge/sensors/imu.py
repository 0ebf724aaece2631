"""The inertial measurement unit in the chest, and the robot's estimate of its attitude."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from humanoid_motion.driver_interface import ImuSample

from hrp2_sim_bridge.physics.frames import quaternion_product
from hrp2_sim_bridge.physics.kinematics import LinkStates
from hrp2_sim_bridge.settings import TICK, SensorSettings

# The gains are low, so that the accelerations of a sway hardly move the attitude (by gain * speed /
# g). The gyro allows this because it is calibrated at rest.
PROPORTIONAL_GAIN = 0.15  # k_P of the attitude filter [1/s]
INTEGRAL_GAIN = 0.002  # k_I of the attitude filter [1/s^2]
# A larger difference between attitude and accelerometer comes from an acceleration of the robot.
LARGEST_CORRECTION = 0.01  # largest difference that the filter corrects [rad]
ACCELERATION_LIMIT = 1.0  # | |f| - g | above which the accelerometer is ignored [m/s^2]
_ANY_HEADING = math.pi**2 / 3.0  # variance of a completely unknown angle [rad^2]


@dataclass(frozen=True)
class ImuVariances:
    """Variances of an IMU's readings at rest, for its three axes; 0 for exact readings.

    Attributes:
        orientation: Variances of rotations about the axes, (3,) [rad^2].
        angular_velocity: Variances of the angular velocity, (3,) [rad^2/s^2].
        specific_force: Variances of the specific force, (3,) [m^2/s^4].
    """

    orientation: tuple[float, float, float]
    angular_velocity: tuple[float, float, float]
    specific_force: tuple[float, float, float]


def imu_variances(settings: SensorSettings) -> ImuVariances:
    """Compute the variances that follow from the settings, for a robot that does not accelerate.

    The variance of the tilt has four parts: the accelerometer's bias, the noise of accelerometer
    and gyro after the filter, and the gyro's bias that remains after the calibration until the
    filter has estimated it.
    """
    if not settings.sensor_noise:
        zero = (0.0, 0.0, 0.0)
        return ImuVariances(zero, zero, zero)
    gain = PROPORTIONAL_GAIN
    left_bias = settings.gyro_noise**2 / settings.imu_calibration_samples
    tilt = (
        (settings.accelerometer_bias / GRAVITY) ** 2
        + (settings.accelerometer_noise / GRAVITY) ** 2 * gain * TICK / 2.0
        + settings.gyro_noise**2 * TICK / (2.0 * gain)
        + left_bias / gain**2)
    rate = settings.gyro_noise**2 + left_bias
    force = settings.accelerometer_noise**2 + settings.accelerometer_bias**2
    return ImuVariances((tilt, tilt, _ANY_HEADING), (rate,) * 3, (force,) * 3)


def mean_specific_force(before: LinkStates, after: LinkStates) -> Array:
    """Compute acceleration minus gravity over a tick, in the IMU's axes at its end, [m/s^2]."""
    acceleration = (after.linear - before.linear) / TICK
    acceleration[2] += GRAVITY
    return np.asarray(acceleration @ after.turn)


def exact_sample(before: LinkStates, after: LinkStates) -> ImuSample:
    """Compute an exact reading from the states of the IMU's frame before and after a tick."""
    return ImuSample(
        after.quaternion, after.angular @ after.turn, mean_specific_force(before, after))


def mean_rate(before: Array, after: Array) -> Array:
    """Compute the mean angular velocity over a tick, which a gyro with its filter measures.

    The arguments are rotation matrices; the result is in the body's frame, (3,) [rad/s].
    """
    return np.asarray(pin.log3(before.T @ after) / TICK)


def level_attitude(specific_force: Array) -> Array:
    """Compute the attitude x, y, z, w of an IMU at rest from its specific force, with heading 0."""
    x, y, z = specific_force.tolist()
    roll = math.atan2(y, z) / 2.0
    pitch = math.atan2(-x, math.hypot(y, z)) / 2.0
    return np.array(
        [
            math.sin(roll) * math.cos(pitch), math.cos(roll) * math.sin(pitch),
            -math.sin(roll) * math.sin(pitch), math.cos(roll) * math.cos(pitch)])


class AttitudeFilter:
    """Estimates attitude and gyro bias from gyro and accelerometer.

    This is the explicit complementary filter of R. Mahony, T. Hamel, J.-M. Pflimlin, "Nonlinear
    complementary filters on the special orthogonal group", IEEE Trans. Automatic Control 53(5),
    2008, with the vertical as the only reference direction: R' = R (Omega - b + k_P w)x,
    b' = -k_I w, w = v x v_hat. Nothing corrects the heading. The accelerometer's direction v is the
    vertical only at rest. Therefore its weight decreases with the difference between its length and
    g, and is 0 at a difference of `ACCELERATION_LIMIT` or more.

    Args:
        orientation: Quaternion x, y, z, w at the start, (4,).
        bias: Bias of the gyro at the start, (3,) [rad/s].
    """

    def __init__(self, orientation: Array, bias: Array) -> None:
        self._turn = orientation.tolist()
        self._bias = bias.tolist()

    @property
    def bias(self) -> Array:
        """Estimated bias of the gyro, (3,) [rad/s]."""
        return np.array(self._bias)

    def update(self, rate: Array, specific_force: Array, duration: float) -> Array:
        """Advance the estimate by one sample; return the attitude x, y, z, w.

        Args:
            rate: Mean reading of the gyro since the last sample, (3,) [rad/s].
            specific_force: Reading of the accelerometer, (3,) [m/s^2].
            duration: Time since the last sample [s].
        """
        # Plain floats are faster than arrays of three numbers.
        x, y, z, w = self._turn
        fx, fy, fz = specific_force.tolist()
        length = math.hypot(fx, fy, fz)
        weight = max(0.0, 1.0 - abs(length - GRAVITY) / ACCELERATION_LIMIT)
        ux, uy, uz = 2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)
        scale = weight / length if weight > 0.0 else 0.0
        error = [
            scale * (fy * uz - fz * uy), scale * (fz * ux - fx * uz), scale * (fx * uy - fy * ux)]
        excess = math.hypot(*error) / LARGEST_CORRECTION
        if excess > 1.0:
            error = [part / excess for part in error]
        # Half the rotation vector of this sample in the body's frame, from which its quaternion
        # follows.
        a, b, c = (
            0.5 * duration * (omega - bias + PROPORTIONAL_GAIN * part)
            for omega, bias, part in zip(rate.tolist(), self._bias, error, strict=True))
        self._bias = [
            bias - INTEGRAL_GAIN * duration * part
            for bias, part in zip(self._bias, error, strict=True)]
        half = math.hypot(a, b, c)
        ratio = math.sin(half) / half if half > 0.0 else 1.0
        turn = quaternion_product(self._turn, (a * ratio, b * ratio, c * ratio, math.cos(half)))
        norm = math.hypot(*turn)
        self._turn = [part / norm for part in turn]
        return np.array(self._turn)


class Imu:
    """The IMU with noise: calibrated at power-on while the robot hangs still, then read each tick.

    Args:
        settings: Noise and biases.
        random: Generator that draws the biases and the calibration's noise.
        hanging: State of the IMU's frame at rest during the calibration.

    Attributes:
        bias: Drawn biases of gyro [rad/s] and accelerometer [m/s^2], (6,).
        filter: The robot's estimator of its attitude.
    """

    def __init__(
        self, settings: SensorSettings, random: np.random.Generator, hanging: LinkStates
    ) -> None:
        self._noise = np.repeat([settings.gyro_noise, settings.accelerometer_noise], 3)
        self.bias = random.standard_normal(6) * np.repeat(
            [settings.gyro_bias, settings.accelerometer_bias], 3)
        samples = settings.imu_calibration_samples
        # The mean over all samples is drawn at once.
        mean = self.bias + random.standard_normal(6) * self._noise / math.sqrt(samples)
        mean[3:] += GRAVITY * hanging.turn[2]
        self.filter = AttitudeFilter(level_attitude(mean[3:]), mean[:3])

    def read(self, before: LinkStates, after: LinkStates, normal: Array) -> ImuSample:
        """Return estimated orientation, angular velocity without bias, and specific force.

        Args:
            before: State of the IMU's frame at the start of the tick.
            after: State of the IMU's frame at the end of the tick.
            normal: Standard normal random numbers for gyro and accelerometer, (6,).
        """
        error = self.bias + self._noise * normal
        gyro = mean_rate(before.turn, after.turn) + error[:3]
        force = mean_specific_force(before, after) + error[3:]
        orientation = self.filter.update(gyro, force, TICK)
        return ImuSample(orientation, gyro - self.filter.bias, force)
