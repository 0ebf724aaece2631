"""The checks of a joint trajectory, all of which it must pass before it moves a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot_types import RobotConfig
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.spline import Spline
from humanoid_motion.tolerances import OVERSHOOT, ROUNDING
from numpy.typing import NDArray

from robot_driver.errors import TrajectoryRefusedError

_SAMPLES = 20_000  # samples of a whole motion that are checked between its points
_SAMPLES_PER_SEGMENT = (9, 129)  # fewest and most samples between two points
_MOST_POINTS = 5_000


@dataclass(frozen=True)
class JointLimits:
    """Limits of the joints that the driver enforces.

    Attributes:
        names: Names of the N joints in the driver's order.
        lower: Lower position limits, (N,) [rad].
        upper: Upper position limits, (N,) [rad].
        velocity: Largest speeds, (N,) [rad/s].
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    velocity: Array

    @classmethod
    def of(cls, robot: RobotConfig) -> JointLimits:
        """Return the limits of a robot's joints."""
        return cls(robot.joint_names, robot.lower, robot.upper, robot.velocity_limit)


@dataclass(frozen=True)
class CheckedTrajectory:
    """Points of a trajectory in the driver's joint order, finite and of the right shape.

    Attributes:
        times: Times of the points from the trajectory's start, strictly increasing, (K,) [s].
        position: Joint positions, (K, N) [rad].
        velocity: Joint velocities, (K, N) [rad/s]; None if the trajectory has none.
        acceleration: Joint accelerations, (K, N) [rad/s^2]; None if the trajectory has none.
    """

    times: Array
    position: Array
    velocity: Array | None
    acceleration: Array | None


def require(ok: object, reason: str, joint: str, value: object, limit: object) -> None:
    """Refuse a trajectory that does not pass a check.

    Raises:
        TrajectoryRefusedError: The check failed; the arguments are those of the error.
    """
    if not ok:
        raise TrajectoryRefusedError(reason, joint, value, limit)


def check_arrays(message: TrajectoryArrays, limits: JointLimits) -> CheckedTrajectory:
    """Check names, shapes, times, values and limits; return the points in the driver's order.

    Raises:
        TrajectoryRefusedError: A check failed; the error has the joint, the value and the limit.
    """
    count, given = len(message.times), tuple(message.joint_names)
    require(count <= _MOST_POINTS, "number of points", "", count, _MOST_POINTS)
    order = _joint_order(given, limits.names)
    times = _checked_times(message.times)
    position = _rows("position", message.positions, count, order, given)
    velocity = acceleration = None
    if any(map(len, message.velocities)):
        velocity = _rows("velocity", message.velocities, count, order, given)
    if any(map(len, message.accelerations)):
        require(velocity is not None, "accelerations without velocities, velocities", "", "none",
                "both")
        acceleration = _rows("acceleration", message.accelerations, count, order, given)
    _check_range("position [rad] of a point above the limit", position,
                 limits.upper + ROUNDING, limits)
    _check_range("position [rad] of a point below the limit", -position,
                 -limits.lower + ROUNDING, limits, sign=-1.0)
    if velocity is not None:
        _check_range("speed [rad/s] of a point", np.abs(velocity),
                     limits.velocity * (1.0 + ROUNDING), limits)
    return CheckedTrajectory(times, position, velocity, acceleration)


def check_spline(spline: Spline, limits: JointLimits, velocity_factor: float) -> None:
    """Check positions and speeds of a whole motion between its points.

    Its largest speed there is the limit times a factor.

    Raises:
        TrajectoryRefusedError: A limit is violated; the error has the joint, value and limit.
    """
    if not len(spline.coefficients):
        return
    with np.errstate(over="ignore", invalid="ignore"):
        each = int(np.clip(_SAMPLES // len(spline.coefficients), *_SAMPLES_PER_SEGMENT))
        _, position, velocity = spline.inner_states(each)
    _check_range("speed [rad/s] between points", np.abs(velocity),
                 limits.velocity * velocity_factor, limits)
    # A motion may start outside the limits, where the robot is; it must not go farther out.
    upper = np.maximum(limits.upper, spline.position[0]) + OVERSHOOT
    lower = np.minimum(limits.lower, spline.position[0]) - OVERSHOOT
    _check_range("position [rad] between points above the limit", position, upper, limits)
    _check_range("position [rad] between points below the limit", -position, -lower, limits,
                 sign=-1.0)


def _check_range(
    what: str, values: Array, bound: Array, limits: JointLimits, sign: float = 1.0
) -> None:
    bad = ~(values <= bound)  # a value that overflowed to NaN is bad, too
    if bad.any():
        row, column = np.argwhere(bad)[0]
        raise TrajectoryRefusedError(
            what, limits.names[column], float(sign * values[row, column]),
            float(sign * bound[column]))


def _joint_order(given: tuple[str, ...], known: tuple[str, ...]) -> NDArray[np.intp]:
    """Return the message's column of each of the driver's joints, all of which it must name."""
    for name in given:
        require(name in known, "unknown joint", name, name, f"the robot's {len(known)} joints")
        require(given.count(name) == 1, "joint named twice, times", name, given.count(name), 1)
    for name in known:
        require(name in given, "joint missing, number of joints", name, len(given), len(known))
    return np.array([given.index(name) for name in known], dtype=np.intp)


def _checked_times(values: Sequence[float]) -> Array:
    times = np.array(values, dtype=float)
    for bad in times[~np.isfinite(times)].tolist():
        raise TrajectoryRefusedError("time [s] of a point is not finite", "", bad, "finite")
    require(times[0] >= 0.0, "time [s] of the first point", "", float(times[0]), 0.0)
    for point in (np.flatnonzero(np.diff(times) <= 0.0) + 1).tolist():
        raise TrajectoryRefusedError(
            f"times [s] must increase, point {point}", "", float(times[point]),
            float(times[point - 1]))
    return times


def _rows(
    what: str, rows: Sequence[Sequence[float]], points: int, order: NDArray[np.intp],
    given: tuple[str, ...],
) -> Array:
    """Return the rows of all points in the driver's order, (K, N), if all of them are numbers."""
    require(len(rows) == points, f"points with {what}", "", len(rows), points)
    for index, row in enumerate(rows):
        require(len(row) == len(order), f"values of {what} in point {index}", "", len(row),
                len(order))
    values = np.array(rows, dtype=float)
    for point, column in np.argwhere(~np.isfinite(values)).tolist():
        raise TrajectoryRefusedError(
            f"{what} in point {point} is not finite", given[column], float(values[point, column]),
            "finite")
    return values[:, order]
