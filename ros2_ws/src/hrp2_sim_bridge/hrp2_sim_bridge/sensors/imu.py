"""The inertial measurement unit in the chest, and the attitude that the robot makes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY

from hrp2_sim_bridge.physics.frames import quaternion_product, rotation
from hrp2_sim_bridge.physics.states import BodyState
from hrp2_sim_bridge.settings import TICK, SensorSettings

# Slow enough that a sway's accelerations move the attitude little (by gain * speed / g), which the
# gyro allows because it is calibrated at rest.
PROPORTIONAL_GAIN = 0.15  # k_P [1/s]
INTEGRAL_GAIN = 0.002  # k_I [1/s^2]
# Of more than this the accelerometer does not correct the attitude: the robot accelerates.
LARGEST_CORRECTION = 0.01  # [rad]
ACCELERATION_LIMIT = 1.0  # | |f| - g | from which the accelerometer does not count [m/s^2]
_ANY_HEADING = math.pi**2 / 3.0  # variance of an angle of which nothing is known [rad^2]


@dataclass(frozen=True)
class ImuSample:
    """Reading of an IMU.

    Attributes:
        orientation: (4,) quaternion x, y, z, w of its frame in the world.
        angular_velocity: (3,) in its frame [rad/s].
        specific_force: (3,) acceleration less gravity, in its frame [m/s^2]; +g upward at rest.
    """

    orientation: Array
    angular_velocity: Array
    specific_force: Array


@dataclass(frozen=True)
class ImuVariances:
    """Variances about or along the three axes of an IMU's readings at rest; 0 where exact.

    Attributes:
        orientation: (3,) [rad^2].
        angular_velocity: (3,) [rad^2/s^2].
        specific_force: (3,) [m^2/s^4].
    """

    orientation: tuple[float, float, float]
    angular_velocity: tuple[float, float, float]
    specific_force: tuple[float, float, float]


def imu_variances(settings: SensorSettings) -> ImuVariances:
    """Variances that the settings imply; accelerations of the robot add to the tilt's.

    The tilt's parts are the accelerometer's bias, what the filter lets through of both noises, and
    what the calibration leaves of the gyro's bias until the filter finds it.
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
        + left_bias / gain**2
    )
    rate = settings.gyro_noise**2 + left_bias
    force = settings.accelerometer_noise**2 + settings.accelerometer_bias**2
    return ImuVariances((tilt, tilt, _ANY_HEADING), (rate,) * 3, (force,) * 3)


def imu_sample(before: BodyState, after: BodyState, duration: float) -> ImuSample:
    """Exact reading from the states of the IMU's frame around a tick.

    Args:
        before: at its begin.
        after: at its end.
        duration: [s].

    Returns:
        Orientation and angular velocity at the end, mean specific force over the tick.
    """
    turn = rotation(after.quaternion).T
    acceleration = (after.linear - before.linear) / duration
    acceleration[2] += GRAVITY
    return ImuSample(after.quaternion, turn @ after.angular, np.asarray(turn @ acceleration))


def mean_rate(before: Array, after: Array, duration: float) -> Array:
    """Mean angular velocity over a tick in the body's frame (3,) [rad/s], as a gyro's filter has.

    Args:
        before: (4,) quaternion x, y, z, w at its begin.
        after: (4,) the same at its end.
        duration: [s].
    """
    x, y, z, w = before.tolist()
    *vector, half_cosine = quaternion_product((-x, -y, -z, w), after.tolist())
    half_sine = math.hypot(*vector)
    if half_sine == 0.0:
        return np.zeros(3)
    # atan of the ratio: the same for a quaternion and its negative.
    angle = 2.0 * math.atan(half_sine / half_cosine)
    return np.array(vector) * (angle / (half_sine * duration))


def level_attitude(specific_force: Array) -> Array:
    """Quaternion x, y, z, w (4,) of an IMU at rest that reads (3,) [m/s^2]; heading 0."""
    x, y, z = specific_force.tolist()
    roll = math.atan2(y, z) / 2.0
    pitch = math.atan2(-x, math.hypot(y, z)) / 2.0
    return np.array(
        [
            math.sin(roll) * math.cos(pitch), math.cos(roll) * math.sin(pitch),
            -math.sin(roll) * math.sin(pitch), math.cos(roll) * math.cos(pitch),
        ]
    )


class AttitudeFilter:
    """Attitude and gyro bias from gyro and accelerometer: explicit complementary filter.

    R. Mahony, T. Hamel, J.-M. Pflimlin, "Nonlinear complementary filters on the special orthogonal
    group", IEEE Trans. Automatic Control 53(5), 2008, with the vertical as the only direction:
    R' = R (Omega - b + k_P w)x, b' = -k_I w, w = v x v_hat. Nothing corrects the heading. The
    accelerometer, whose direction v is the vertical at rest only, counts less the farther its
    length is from g, and not at all from `ACCELERATION_LIMIT` on.

    Args:
        orientation: (4,) quaternion x, y, z, w to start from.
        bias: (3,) of the gyro to start from [rad/s].
    """

    def __init__(self, orientation: Array, bias: Array) -> None:
        self._turn = orientation.tolist()
        self._bias = bias.tolist()

    @property
    def bias(self) -> Array:
        """Estimate of the gyro's bias (3,) [rad/s]."""
        return np.array(self._bias)

    def update(self, rate: Array, specific_force: Array, duration: float) -> Array:
        """Advance by one sample; in plain floats, which are quicker than arrays of three.

        Args:
            rate: (3,) the gyro's, mean over the time since the last sample [rad/s].
            specific_force: (3,) the accelerometer's [m/s^2].
            duration: since the last sample [s].

        Returns:
            (4,) quaternion x, y, z, w of the IMU's frame in the world.
        """
        x, y, z, w = self._turn
        fx, fy, fz = specific_force.tolist()
        length = math.hypot(fx, fy, fz)
        weight = max(0.0, 1.0 - abs(length - GRAVITY) / ACCELERATION_LIMIT)
        ux, uy, uz = 2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)
        scale = weight / length if weight > 0.0 else 0.0
        error = [
            scale * (fy * uz - fz * uy), scale * (fz * ux - fx * uz), scale * (fx * uy - fy * ux),
        ]
        wide = math.hypot(*error) / LARGEST_CORRECTION
        if wide > 1.0:
            error = [wrong / wide for wrong in error]
        # Half the rotation of this sample, and then its quaternion, applied on the body's side.
        a, b, c = (
            0.5 * duration * (omega - bias + PROPORTIONAL_GAIN * wrong)
            for omega, bias, wrong in zip(rate.tolist(), self._bias, error, strict=True)
        )
        self._bias = [
            bias - INTEGRAL_GAIN * duration * wrong
            for bias, wrong in zip(self._bias, error, strict=True)
        ]
        half = math.hypot(a, b, c)
        ratio = math.sin(half) / half if half > 0.0 else 1.0
        turn = quaternion_product(self._turn, (a * ratio, b * ratio, c * ratio, math.cos(half)))
        norm = math.hypot(*turn)
        self._turn = [part / norm for part in turn]
        return np.array(self._turn)


class Imu:
    """The noisy IMU, from power-on: calibrated while the robot hangs still, then read each tick.

    Args:
        settings: noise and biases.
        random: draws the biases and the calibration's noise.
        hanging: state of its frame at rest.

    Attributes:
        bias: (6,) of gyro [rad/s] and accelerometer [m/s^2], as drawn.
        filter: the robot's estimator.
    """

    def __init__(
        self, settings: SensorSettings, random: np.random.Generator, hanging: BodyState
    ) -> None:
        self._noise = np.repeat([settings.gyro_noise, settings.accelerometer_noise], 3)
        self.bias = random.standard_normal(6) * np.repeat(
            [settings.gyro_bias, settings.accelerometer_bias], 3
        )
        samples = settings.imu_calibration_samples
        # The mean of so many samples, drawn at once.
        mean = self.bias + random.standard_normal(6) * self._noise / math.sqrt(samples)
        mean[3:] += GRAVITY * rotation(hanging.quaternion)[2]
        self.filter = AttitudeFilter(level_attitude(mean[3:]), mean[:3])

    def read(self, before: BodyState, after: BodyState, normal: Array) -> ImuSample:
        """What the IMU and the robot's estimator say at the end of a tick.

        Args:
            before: state of its frame at the tick's begin.
            after: at its end.
            normal: (6,) standard normal numbers: gyro, accelerometer.

        Returns:
            Estimated orientation, angular velocity without the estimated bias, specific force.
        """
        error = self.bias + self._noise * normal
        gyro = mean_rate(before.quaternion, after.quaternion, TICK) + error[:3]
        force = imu_sample(before, after, TICK).specific_force + error[3:]
        orientation = self.filter.update(gyro, force, TICK)
        return ImuSample(orientation, gyro - self.filter.bias, force)
