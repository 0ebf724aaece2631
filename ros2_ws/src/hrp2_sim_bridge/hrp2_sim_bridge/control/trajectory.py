"""A joint trajectory as it arrives, and the checks before any of it moves a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.spline import Spline
from numpy.typing import NDArray

from hrp2_sim_bridge.errors import TrajectoryRefusedError

_SAMPLES = 20_000  # of a whole motion between its points
_SAMPLES_PER_SEGMENT = (9, 129)  # at least and at most
_MOST_POINTS = 5_000
_POSITION_SLACK = 1e-6  # rounding of a point planned on the limit [rad]
_POSITION_OVERSHOOT = 0.005  # of the spline between two points inside the limits [rad]


@dataclass(frozen=True)
class JointLimits:
    """What the driver allows.

    Attributes:
        names: (N) joint names in the driver's order.
        lower: (N,) [rad].
        upper: (N,) [rad].
        velocity: (N,) largest speed [rad/s].
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    velocity: Array


@dataclass(frozen=True)
class TrajectoryArrays:
    """The content of a trajectory_msgs/JointTrajectory as sequences, unchecked.

    Attributes:
        joint_names: names in the message's order.
        times: time_from_start of each point [s].
        positions, velocities, accelerations: one sequence a point, velocities and accelerations
            empty where the message has none.
    """

    joint_names: Sequence[str]
    times: Sequence[float]
    positions: Sequence[Sequence[float]]
    velocities: Sequence[Sequence[float]] = ()
    accelerations: Sequence[Sequence[float]] = ()

    @property
    def is_stop(self) -> bool:
        """True for a trajectory without points, which means: stop."""
        return len(self.times) == 0


@dataclass(frozen=True)
class CheckedTrajectory:
    """Arrays in the driver's joint order, finite and of the right shape.

    Attributes:
        times: (K,) [s].
        position: (K, N) [rad].
        velocity: (K, N) [rad/s] or None.
        acceleration: (K, N) [rad/s^2] or None.
    """

    times: Array
    position: Array
    velocity: Array | None
    acceleration: Array | None


def check_arrays(message: TrajectoryArrays, limits: JointLimits) -> CheckedTrajectory:
    """Check names, shapes, times, finite values, position and velocity limits of the points.

    Args:
        message: at least one point.
        limits: of the N joints.

    Raises:
        TrajectoryRefusedError: with the joint, the value and the limit.
    """
    if len(message.times) > _MOST_POINTS:
        raise TrajectoryRefusedError("points", "", len(message.times), _MOST_POINTS)
    order = _joint_order(message.joint_names, limits.names)
    times = _checked_times(message.times)
    given = tuple(message.joint_names)
    position = _rows("position", message.positions, len(times), order, given)
    velocity = acceleration = None
    if _present(message.velocities):
        velocity = _rows("velocity", message.velocities, len(times), order, given)
    if _present(message.accelerations):
        if velocity is None:
            raise TrajectoryRefusedError("accelerations without velocities", "", "none", "both")
        acceleration = _rows("acceleration", message.accelerations, len(times), order, given)
    _check_range("position [rad] of a point above the limit", position,
                 limits.upper + _POSITION_SLACK, limits)
    _check_range("position [rad] of a point below the limit", -position,
                 -limits.lower + _POSITION_SLACK, limits, sign=-1.0)
    if velocity is not None:
        _check_range("speed [rad/s] of a point", np.abs(velocity),
                     limits.velocity * (1.0 + 1e-6), limits)
    return CheckedTrajectory(times, position, velocity, acceleration)


def check_spline(spline: Spline, limits: JointLimits, velocity_factor: float) -> None:
    """Check the motion between the points.

    Args:
        spline: the whole motion.
        limits: of its joints.
        velocity_factor: how much more than the limit the spline may reach between points.

    Raises:
        TrajectoryRefusedError: with the joint, the value and the limit.
    """
    if not len(spline.coefficients):
        return
    with np.errstate(over="ignore", invalid="ignore"):
        each = int(np.clip(_SAMPLES // len(spline.coefficients), *_SAMPLES_PER_SEGMENT))
        _, position, velocity = spline.inner_states(each)
    _check_range("speed [rad/s] between points", np.abs(velocity),
                 limits.velocity * velocity_factor, limits)
    # A motion may start outside (the robot was there), so only new ground counts.
    upper = np.maximum(limits.upper, spline.position[0]) + _POSITION_OVERSHOOT
    lower = np.minimum(limits.lower, spline.position[0]) - _POSITION_OVERSHOOT
    _check_range("position [rad] between points above the limit", position, upper, limits)
    _check_range("position [rad] between points below the limit", -position, -lower, limits,
                 sign=-1.0)


def _check_range(
    what: str, values: Array, bound: Array, limits: JointLimits, sign: float = 1.0
) -> None:
    bad = ~(values <= bound)  # so that what overflowed to NaN is bad too
    if not bad.any():
        return
    row, column = np.argwhere(bad)[0]
    raise TrajectoryRefusedError(
        what, limits.names[column], float(sign * values[row, column]), float(sign * bound[column])
    )


def _present(rows: Sequence[Sequence[float]]) -> bool:
    return any(len(row) for row in rows)


def _joint_order(given: Sequence[str], known: tuple[str, ...]) -> NDArray[np.intp]:
    """Column of the message that holds each of the driver's joints."""
    column: dict[str, int] = {}
    for index, name in enumerate(given):
        if name not in known:
            raise TrajectoryRefusedError("unknown joint", name, name, f"the {len(known)} joints")
        if name in column:
            raise TrajectoryRefusedError("joint named twice", name, 2, 1)
        column[name] = index
    for name in known:
        if name not in column:
            raise TrajectoryRefusedError("joint missing", name, len(given), len(known))
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
