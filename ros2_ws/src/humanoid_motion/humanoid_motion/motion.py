"""Sampled motions of the whole robot and the smooth time laws they are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline


@dataclass(frozen=True)
class Motion:
    """A whole-body motion at N instants, base_link upright (orientation parallel to odom).

    Attributes:
        time: From the start of the phase, (N,) [s].
        joints: Positions in the robot's joint order, (N, 30) [rad].
        joint_speed: (N, 30) [rad/s].
        joint_acceleration: (N, 30) [rad/s^2].
        base: Position of base_link in odom, (N, 3) [m].
        base_speed: (N, 3) [m/s].
        base_acceleration: (N, 3) [m/s^2].
    """

    time: Array
    joints: Array
    joint_speed: Array
    joint_acceleration: Array
    base: Array
    base_speed: Array
    base_acceleration: Array

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time)

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])


def min_jerk(time: ArrayLike, duration: float) -> Array:
    """Minimum-jerk rise from 0 to 1 within a duration, any shape; 0 before, 1 after."""
    return min_jerk_course(time, duration)[0]


def min_jerk_course(time: ArrayLike, duration: float) -> tuple[Array, Array, Array]:
    """`min_jerk` with its speed [1/s] and acceleration [1/s^2]."""
    x = np.clip(np.asarray(time, dtype=float) / duration, 0.0, 1.0)
    way = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    speed = 30.0 * x**2 * (1.0 - x) ** 2 / duration
    return way, speed, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / duration**2


def rest_to_rest(nodes: Array, joints: Array, base: Array, time: Array) -> Motion:
    """Motion through postures that begins and ends at rest.

    Quintic splines, so that speeds and accelerations are smooth.

    Args:
        nodes: Times of the postures, (K,), K >= 6 [s].
        joints: (K, 30) [rad].
        base: (K, 3) [m].
        time: Of the motion's samples, within the nodes, (N,) [s].
    """
    rest = [(1, np.zeros(joints.shape[1] + 3)), (2, np.zeros(joints.shape[1] + 3))]
    spline = make_interp_spline(nodes, np.hstack([joints, base]), k=5, bc_type=(rest, rest))
    return from_derivatives(time, spline(time), spline(time, 1), spline(time, 2))


def from_derivatives(time: Array, position: Array, speed: Array, acceleration: Array) -> Motion:
    """Motion from stacked (N, 33) arrays: joints first, then the base."""
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
    """One posture at rest: joints (30,) [rad] and base (3,) [m]."""
    zero = np.zeros((1, len(joints) + 3))
    return from_derivatives(np.zeros(1), np.append(joints, base)[None, :], zero, zero)
