"""The checks of a joint trajectory, all of which it must pass before it moves a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.spline import Spline
from numpy.typing import NDArray

from hrp2_sim_bridge.errors import TrajectoryRefusedError

_SAMPLES = 20_000  # samples of a whole motion that are checked between its points
_SAMPLES_PER_SEGMENT = (9, 129)  # fewest and most samples between two points
_MOST_POINTS = 5_000
_POSITION_SLACK = 1e-6  # rounding error of a point that was planned on a limit [rad]
_POSITION_OVERSHOOT = 0.005  # allowed overshoot of a limit between two points [rad]
_SPEED_SLACK = 1e-6  # relative rounding error of a speed that was planned on its limit


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


def check_arrays(message: TrajectoryArrays, limits: JointLimits) -> CheckedTrajectory:
    """Check the joint names, and shapes, times, values and limits of the points.

    Args:
        message: Trajectory with at least one point.
        limits: Limits of the N joints.

    Returns:
        The points in the driver's joint order.

    Raises:
        TrajectoryRefusedError: A check failed; the error has the joint, the value and the limit.
    """
    if len(message.times) > _MOST_POINTS:
        raise TrajectoryRefusedError("number of points", "", len(message.times), _MOST_POINTS)
    order = _joint_order(message.joint_names, limits.names)
    times = _checked_times(message.times)
    given = tuple(message.joint_names)
    position = _rows("position", message.positions, len(times), order, given)
    velocity = acceleration = None
    if _present(message.velocities):
        velocity = _rows("velocity", message.velocities, len(times), order, given)
    if _present(message.accelerations):
        if velocity is None:
            raise TrajectoryRefusedError(
                "accelerations without velocities, velocities", "", "none", "both"
            )
        acceleration = _rows("acceleration", message.accelerations, len(times), order, given)
    _check_range("position [rad] of a point above the limit", position,
                 limits.upper + _POSITION_SLACK, limits)
    _check_range("position [rad] of a point below the limit", -position,
                 -limits.lower + _POSITION_SLACK, limits, sign=-1.0)
    if velocity is not None:
        _check_range("speed [rad/s] of a point", np.abs(velocity),
                     limits.velocity * (1.0 + _SPEED_SLACK), limits)
    return CheckedTrajectory(times, position, velocity, acceleration)


def check_spline(spline: Spline, limits: JointLimits, velocity_factor: float) -> None:
    """Check positions and speeds between the points.

    Args:
        spline: The whole motion.
        limits: Limits of its joints.
        velocity_factor: Largest speed between points as a multiple of the speed limit.

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
    upper = np.maximum(limits.upper, spline.position[0]) + _POSITION_OVERSHOOT
    lower = np.minimum(limits.lower, spline.position[0]) - _POSITION_OVERSHOOT
    _check_range("position [rad] between points above the limit", position, upper, limits)
    _check_range("position [rad] between points below the limit", -position, -lower, limits,
                 sign=-1.0)


def _check_range(
    what: str, values: Array, bound: Array, limits: JointLimits, sign: float = 1.0
) -> None:
    bad = ~(values <= bound)  # a value that overflowed to NaN is bad, too
    if not bad.any():
        return
    row, column = np.argwhere(bad)[0]
    raise TrajectoryRefusedError(
        what, limits.names[column], float(sign * values[row, column]), float(sign * bound[column])
    )


def _present(rows: Sequence[Sequence[float]]) -> bool:
    return any(len(row) for row in rows)


def _joint_order(given: Sequence[str], known: tuple[str, ...]) -> NDArray[np.intp]:
    """Return the message's column of each of the driver's joints.

    Raises:
        TrajectoryRefusedError: The message does not name each joint exactly once.
    """
    column: dict[str, int] = {}
    for index, name in enumerate(given):
        if name not in known:
            raise TrajectoryRefusedError(
                "unknown joint", name, name, f"the robot's {len(known)} joints"
            )
        if name in column:
            raise TrajectoryRefusedError("joint named twice, times", name, 2, 1)
        column[name] = index
    for name in known:
        if name not in column:
            raise TrajectoryRefusedError(
                "joint missing, number of joints", name, len(given), len(known)
            )
    return np.array([column[name] for name in known], dtype=np.intp)


def _checked_times(values: Sequence[float]) -> Array:
    times = np.array(values, dtype=float)
    if not np.isfinite(times).all():
        bad = float(times[~np.isfinite(times)][0])
        raise TrajectoryRefusedError("time [s] of a point is not finite", "", bad, "finite")
    if times[0] < 0.0:
        raise TrajectoryRefusedError("time [s] of the first point", "", float(times[0]), 0.0)
    steps = np.diff(times)
    if (steps <= 0.0).any():
        point = int(np.argmax(steps <= 0.0)) + 1
        raise TrajectoryRefusedError(
            f"times [s] must increase, point {point}", "", float(times[point]),
            float(times[point - 1]),
        )
    return times


def _rows(
    what: str,
    rows: Sequence[Sequence[float]],
    points: int,
    order: NDArray[np.intp],
    given: tuple[str, ...],
) -> Array:
    if len(rows) != points:
        raise TrajectoryRefusedError(f"points with {what}", "", len(rows), points)
    for index, row in enumerate(rows):
        if len(row) != len(order):
            raise TrajectoryRefusedError(
                f"values of {what} in point {index}", "", len(row), len(order)
            )
    values = np.array(rows, dtype=float)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise TrajectoryRefusedError(
            f"{what} in point {row} is not finite", given[column], float(values[row, column]),
            "finite",
        )
    return values[:, order]
