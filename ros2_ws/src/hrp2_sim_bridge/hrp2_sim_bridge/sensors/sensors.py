"""The sensors of the robot, and the encoder at the door's hinge."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES, RobotConfig
from humanoid_motion.driver_interface import TickSample

from hrp2_sim_bridge.physics.frames import cross, into_frame
from hrp2_sim_bridge.physics.kinematics import LinkStates, SensedBodies
from hrp2_sim_bridge.sensors.imu import Imu, exact_sample
from hrp2_sim_bridge.settings import SAMPLES_PER_TICK, TICK, SensorSettings

COUNTS_PER_TURN = 14400  # counts of the door's encoder per turn: 3600 lines in quadrature
# Streams of random numbers under the world's seed, different from that of the door's encoder.
_STREAM, _WRIST_STREAM = 1, 2


def outer_wrenches(
    reactions: Array, before: LinkStates, after: LinkStates, duration: float, bodies: SensedBodies,
) -> Array:
    """Compute force and torque of the surroundings on bodies beyond force sensors, in their frames.

    The sensor sits above the body, a sole or a hand, so its reading R, R_n does not contain the
    body's own weight and inertia: f = m (a_c - g) - R and, about the frame's origin, with its
    acceleration a and the center c, n = I alpha + omega x I omega + m c x (a - g) - R_n.

    Args:
        reactions: Mean force [N] and torque [N m] of the robot on each body, (..., B, 6).
        before: States of the bodies before the duration, (..., B).
        after: States of the bodies after it, (..., B).
        duration: Duration [s].
        bodies: The first B bodies.

    Returns:
        Force [N] and torque about the origin of the body's frame [N m], (..., B, 6). That on a sole
        points along +z when the robot stands.
    """
    acceleration = (after.linear - before.linear) / duration
    acceleration[..., 2] += GRAVITY
    alpha = into_frame(after.turn, (after.angular - before.angular) / duration)
    omega = into_frame(after.turn, after.angular)
    count = reactions.shape[-2]
    mass, inertia = bodies.mass[:count, None], bodies.inertia[:count]
    center = np.broadcast_to(bodies.center[:count], alpha.shape)
    lifted = into_frame(after.turn, acceleration)
    force = mass * (lifted + cross(alpha, center) + cross(omega, cross(omega, center)))
    torque = (inertia @ alpha[..., None])[..., 0] + mass * cross(center, lifted)
    torque += cross(omega, (inertia @ omega[..., None])[..., 0])
    return np.concatenate([force, torque], axis=-1) - reactions


class EncoderCounter:
    """A counter board: whole counts of the hinge's encoder from an arbitrary zero, with overflow.

    Args:
        offset: Count at the closed door.
        bits: Width of the counter; it counts from 0 to 2^bits - 1.
    """

    def __init__(self, offset: int, bits: int) -> None:
        self._offset = int(offset)
        self._modulus = 1 << bits

    def count(self, angle: float) -> int:
        """Return the count at an angle of the door [rad]."""
        return (self._offset + math.floor(angle / math.tau * COUNTS_PER_TURN)) % self._modulus


class JointEncoders:
    """Incremental encoders on the motors, and the velocities that a driver computes from them.

    Args:
        resolution: Joint angle of one count, (J,) [rad].
        position: Joint positions at power-on, (J,) [rad].
    """

    def __init__(self, resolution: Array, position: Array) -> None:
        self._resolution = resolution
        self._before = self._quantized(position)

    def _quantized(self, position: Array) -> Array:
        return np.asarray(np.rint(position / self._resolution) * self._resolution)

    def read(self, position: Array) -> tuple[Array, Array]:
        """Return positions in whole counts [rad] and their changes over the tick [rad/s], (J,).

        A change is the mean velocity, with a delay of half a tick (2.5 ms).
        """
        quantized = self._quantized(position)
        velocity = (quantized - self._before) / TICK
        self._before = quantized
        return quantized, velocity


class ForceSensors:
    """Force sensors of both feet or both wrists, calibrated at power-on.

    As on HRP-2 the offsets are measured while the robot hangs: feet and hands then carry no load,
    and the mean reading is the bias plus the remaining noise.

    Args:
        settings: Noise and biases.
        random: Generator that draws the biases and the calibration's noise.

    Attributes:
        bias: Bias that remains in the readings, left and right, (2, 6) [N, N m].
    """

    def __init__(self, settings: SensorSettings, random: np.random.Generator) -> None:
        noise = np.repeat([settings.force_noise, settings.torque_noise], 3)
        spread = np.repeat([settings.force_bias, settings.torque_bias], 3)
        bias = spread * random.standard_normal((2, 6))
        # The mean is drawn at once; its noise is smaller by the root of the number of samples.
        in_air = noise / math.sqrt(settings.force_calibration_samples)
        reading = bias + in_air * random.standard_normal((2, 6))
        self.bias = bias - reading if settings.force_sensor_calibrated else bias
        self._noise = noise / math.sqrt(SAMPLES_PER_TICK)

    def read(self, wrenches: Array, normal: Array) -> Array:
        """Return mean readings (2, 6) over a tick from true ones and standard normal numbers."""
        return wrenches + self.bias + self._noise * normal


class RobotSensors:
    """All sensors of the robot, with noise or exact.

    Args:
        robot: Configuration of the robot.
        settings: Noise and biases of the sensors, or whether they are exact.
        seed: Seed of noise and biases.
    """

    def __init__(self, robot: RobotConfig, settings: SensorSettings, seed: int) -> None:
        self._resolution = robot.joint_resolution
        self._settings = settings
        self._seed = seed

    def power_on(self, position: Array, imu: LinkStates) -> None:
        """Switch the sensors on and calibrate them; biases and noise follow from the seed alone.

        The joints are at positions (J,) [rad], and the IMU's frame is at rest.
        """
        self._random = np.random.default_rng([self._seed, _STREAM])
        self._imu_before = imu
        self.encoders = JointEncoders(self._resolution, position)
        self.feet = ForceSensors(self._settings, self._random)
        self._wrist_random = np.random.default_rng([self._seed, _WRIST_STREAM])
        self.wrists = ForceSensors(self._settings, self._wrist_random)
        self.imu = Imu(self._settings, self._random, imu)

    def read(
        self,
        time: float,
        joints: Array,
        wrenches: Array,
        imu: LinkStates,
        counts: Sequence[int],
    ) -> TickSample:
        """Return the readings at the end of a tick.

        Args:
            time: Time at the end of the tick [s].
            joints: True positions [rad], velocities [rad/s] and motor torques [N m], (3, J).
            wrenches: True mean wrenches over the tick on the left and the right sole, and on the
                left and the right hand if their wrists have sensors, (2, 6) or (4, 6) [N, N m].
            imu: True state of the IMU's frame.
            counts: Counts of the door's encoder since the previous tick.
        """
        before, self._imu_before = self._imu_before, imu
        position, velocity, torque = joints
        feet, hands = wrenches[: len(SIDES)], wrenches[len(SIDES) :]
        if self._settings.sensor_noise:
            normal = self._random.standard_normal((3, 6))
            position, velocity = self.encoders.read(position)
            feet = self.feet.read(feet, normal[:2])
            if len(hands):
                hands = self.wrists.read(hands, self._wrist_random.standard_normal((2, 6)))
            sample = self.imu.read(before, imu, normal[2])
        else:
            sample = exact_sample(before, imu)
        left, right = feet
        return TickSample(
            time, position, velocity, torque, left, right, sample, tuple(counts), *hands)
