"""What the robot's and the door's sensors say."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.physics.states import BodyState
from hrp2_sim_bridge.sensors.imu import Imu, ImuSample, imu_sample
from hrp2_sim_bridge.settings import SAMPLES_PER_TICK, TICK, SensorSettings

COUNTS_PER_TURN = 14400  # 3600 lines, quadrature
_STREAM = 1  # of random numbers under the world's seed: not the one of the door's encoder


@dataclass(frozen=True)
class TickSample:
    """Everything the sensors say at the end of a control tick; joints in HRP-2's order.

    Attributes:
        time: [s].
        position: (30,) [rad].
        velocity: (30,) [rad/s].
        effort: (30,) [N m].
        left_wrench: (6,) mean over the tick of the floor's force and torque in l_sole [N, N m].
        right_wrench: (6,) the same in r_sole.
        imu: the IMU.
        counts: of the door's encoder, one a millisecond since the tick before.
    """

    time: float
    position: Array
    velocity: Array
    effort: Array
    left_wrench: Array
    right_wrench: Array
    imu: ImuSample
    counts: tuple[int, ...]


class EncoderCounter:
    """A counter board: whole counts of the hinge's encoder from an arbitrary zero, wrapping.

    Args:
        offset: count at the closed door.
        bits: width of the counter, 16 or 32; it counts 0 .. 2^bits - 1.
    """

    def __init__(self, offset: int, bits: int) -> None:
        if bits not in (16, 32):
            raise SettingError("encoder_bits", bits, "16 or 32")
        self._offset = int(offset)
        self._modulus = 1 << bits

    def count(self, angle: float) -> int:
        """Count at an angle of the door [rad]."""
        return (self._offset + math.floor(angle / math.tau * COUNTS_PER_TURN)) % self._modulus


class JointEncoders:
    """Incremental encoders on the motors, and the velocities that a driver makes of them.

    Args:
        resolution: (30,) joint angle of a count [rad].
        position: (30,) at power-on [rad].
    """

    def __init__(self, resolution: Array, position: Array) -> None:
        self._resolution = resolution
        self._before = self._quantized(position)

    def _quantized(self, position: Array) -> Array:
        quantized: Array = np.rint(position / self._resolution) * self._resolution
        return quantized

    def read(self, position: Array) -> tuple[Array, Array]:
        """What they say of the true positions (30,) [rad] at the end of a tick.

        Returns:
            Positions (30,) in whole counts [rad], and their differences over the tick (30,)
            [rad/s]: the mean speed, half a tick (2.5 ms) late.
        """
        quantized = self._quantized(position)
        velocity = (quantized - self._before) / TICK
        self._before = quantized
        return quantized, velocity


class FootForceSensors:
    """Force sensors of both feet, from power-on.

    As on HRP-2 their offsets are taken while the robot hangs: the feet then bear nothing, and the
    mean reading is the bias, but for what is left of the noise.

    Args:
        settings: noise and biases.
        random: draws the biases and the calibration's noise.

    Attributes:
        bias: (2, 6) that is left in the readings, left and right [N, N m].
    """

    def __init__(self, settings: SensorSettings, random: np.random.Generator) -> None:
        noise = np.repeat([settings.force_noise, settings.torque_noise], 3)
        spread = np.repeat([settings.force_bias, settings.torque_bias], 3)
        bias = spread * random.standard_normal((2, 6))
        # Means of many samples are drawn at once: their noise is less by the root of the number.
        in_air = noise / math.sqrt(settings.force_calibration_samples)
        reading = bias + in_air * random.standard_normal((2, 6))
        self.bias = bias - reading if settings.force_sensor_calibrated else bias
        self._noise = noise / math.sqrt(SAMPLES_PER_TICK)

    def read(self, wrenches: Array, normal: Array) -> Array:
        """What they say of a tick: the mean of its samples.

        Args:
            wrenches: (2, 6) true mean over the tick, left and right [N, N m].
            normal: (2, 6) standard normal numbers.
        """
        return wrenches + self.bias + self._noise * normal


class RobotSensors:
    """All sensors of the robot: noisy ones as the settings say, or exact ones.

    Args:
        robot: configuration.
        settings: of the sensors.
        seed: of their noise and biases.
    """

    def __init__(self, robot: RobotConfig, settings: SensorSettings, seed: int) -> None:
        self._resolution = robot.joint_resolution
        self._settings = settings
        self._seed = seed

    def power_on(self, position: Array, imu: BodyState) -> None:
        """Begin anew: biases, calibrations and all later noise follow from the seed alone.

        Args:
            position: (30,) joint angles [rad].
            imu: state of the IMU's frame, at rest.
        """
        self._random = np.random.default_rng([self._seed, _STREAM])
        self._imu_before = imu
        self.encoders = JointEncoders(self._resolution, position)
        self.feet = FootForceSensors(self._settings, self._random)
        self.imu = Imu(self._settings, self._random, imu)

    def read(
        self,
        time: float,
        joints: Array,
        wrenches: Array,
        imu: BodyState,
        counts: Sequence[int],
    ) -> TickSample:
        """What the sensors say at the end of a tick.

        Args:
            time: [s].
            joints: (3, 30) true positions [rad], velocities [rad/s] and motor torques [N m].
            wrenches: (2, 6) true mean over the tick, left and right [N, N m].
            imu: true state of the IMU's frame.
            counts: of the door's encoder.
        """
        before, self._imu_before = self._imu_before, imu
        position, velocity, torque = joints
        if self._settings.sensor_noise:
            normal = self._random.standard_normal((3, 6))
            position, velocity = self.encoders.read(position)
            wrenches = self.feet.read(wrenches, normal[:2])
            sample = self.imu.read(before, imu, normal[2])
        else:
            sample = imu_sample(before, imu, TICK)
        return TickSample(
            time, position, velocity, torque, wrenches[0], wrenches[1], sample, tuple(counts)
        )
