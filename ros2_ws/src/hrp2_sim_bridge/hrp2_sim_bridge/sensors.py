"""What the robot's and the door's sensors would say."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hrp2_sim_bridge.engine import GRAVITY
from hrp2_sim_bridge.errors import SettingError
from hrp2_sim_bridge.frames import BodyState, rotation
from hrp2_sim_bridge.spline import Array

COUNTS_PER_TURN = 14400  # 3600 lines, quadrature


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


def imu_sample(before: BodyState, after: BodyState, duration: float) -> ImuSample:
    """Reading from the states of the IMU's frame around a tick [s]; mean specific force over it."""
    turn = rotation(after.quaternion).T
    acceleration = (after.linear - before.linear) / duration
    acceleration[2] += GRAVITY
    return ImuSample(after.quaternion, turn @ after.angular, np.asarray(turn @ acceleration))
