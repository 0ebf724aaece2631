"""Sampled motions of the whole robot, and the minimum-jerk time law of which many consist."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline


@dataclass(frozen=True)
class BaseYaw:
    """The heading of an upright base_link at N samples: its turn about odom's z axis.

    Attributes:
        angle: Angles, without jumps by a whole turn, (N,) [rad].
        speed: Angular velocities, (N,) [rad/s].
        acceleration: Angular accelerations, (N,) [rad/s^2].
    """

    angle: Array
    speed: Array
    acceleration: Array


@dataclass(frozen=True)
class Motion:
    """A whole-body motion at N samples; base_link stays upright.

    Attributes:
        time: Times since the start of the phase, increasing, (N,) [s].
        joints: Positions of the joints in the robot's order, (N, J) [rad].
        joint_speed: Velocities of the joints, (N, J) [rad/s].
        joint_acceleration: Accelerations of the joints, (N, J) [rad/s^2].
        base: Position of base_link in odom, (N, 3) [m].
        base_speed: Velocity of base_link in odom, (N, 3) [m/s].
        base_acceleration: Acceleration of base_link in odom, (N, 3) [m/s^2].
        base_yaw: Heading of base_link; None if base_link stays parallel to odom.
    """

    time: Array
    joints: Array
    joint_speed: Array
    joint_acceleration: Array
    base: Array
    base_speed: Array
    base_acceleration: Array
    base_yaw: BaseYaw | None = None

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])


def min_jerk(time: ArrayLike, duration: float) -> Array:
    """Compute the minimum-jerk rise from 0 at time 0 to 1 at a duration [s], constant outside."""
    return min_jerk_course(time, duration)[0]


def min_jerk_course(time: ArrayLike, duration: float) -> tuple[Array, Array, Array]:
    """Compute `min_jerk`, its speed [1/s] and its acceleration [1/s^2], shaped as the times [s]."""
    x = np.clip(np.asarray(time, dtype=float) / duration, 0.0, 1.0)
    rise = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    speed = 30.0 * x**2 * (1.0 - x) ** 2 / duration
    return rise, speed, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / duration**2


def rest_to_rest(nodes: Array, joints: Array, base: Array, time: Array) -> Motion:
    """Make a motion through postures that begins and ends at rest.

    It consists of quintic splines, so that speeds and accelerations are smooth.

    Args:
        nodes: Times of the postures, (K,) with K >= 6 [s].
        joints: Joints of the postures, (K, J) [rad].
        base: Positions of base_link in odom, (K, 3) [m].
        time: Times of the motion's samples, within the nodes, (N,) [s].
    """
    rest = [(1, np.zeros(joints.shape[1] + 3)), (2, np.zeros(joints.shape[1] + 3))]
    spline = make_interp_spline(nodes, np.hstack([joints, base]), k=5, bc_type=(rest, rest))
    return from_derivatives(time, spline(time), spline(time, 1), spline(time, 2))


def from_derivatives(time: Array, position: Array, speed: Array, acceleration: Array) -> Motion:
    """Make a motion from arrays (N, J + 3) whose last three columns are those of the base."""
    return Motion(
        time=time,
        joints=position[:, :-3],
        joint_speed=speed[:, :-3],
        joint_acceleration=acceleration[:, :-3],
        base=position[:, -3:],
        base_speed=speed[:, -3:],
        base_acceleration=acceleration[:, -3:],
    )


def still(joints: Array, base: Array) -> Motion:
    """Make a motion of one sample at rest, from joints (J,) [rad] and base (3,) [m] in odom."""
    zero = np.zeros((1, len(joints) + 3))
    return from_derivatives(np.zeros(1), np.append(joints, base)[None, :], zero, zero)
