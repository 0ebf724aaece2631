"""The quintic polynomial between two points of a trajectory: its coefficients and its values.

ros2_control's JointTrajectoryController joins two points that carry positions, velocities and
accelerations with a quintic in the time since the first point.
"""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

Point = tuple[Array, Array, Array]  # position [rad], velocity [rad/s], acceleration [rad/s^2]


def quintic(duration: float | Array, start: Point, end: Point) -> tuple[Array, ...]:
    """Compute the quintic that joins two points.

    Args:
        duration: Time from the first point to the second [s].
        start: Position, velocity and acceleration of the first point.
        end: Position, velocity and acceleration of the second point.

    Returns:
        Six coefficients, of the powers 0 to 5 of the time since the first point [s].
    """
    h, (q0, v0, a0), (q1, v1, a1) = duration, start, end
    rise = q1 - q0
    return (
        q0,
        v0,
        a0 / 2.0,
        (20.0 * rise / h - (8.0 * v1 + 12.0 * v0) - (3.0 * a0 - a1) * h) / (2.0 * h**2),
        (-30.0 * rise / h + (14.0 * v1 + 16.0 * v0) + (3.0 * a0 - 2.0 * a1) * h) / (2.0 * h**3),
        (12.0 * rise / h - 6.0 * (v1 + v0) - (a0 - a1) * h) / (2.0 * h**4),
    )


def rows(time: ArrayLike) -> Array:
    """Compute the rows that turn coefficients into position, velocity and acceleration.

    Args:
        time: Times since the first point, (...) [s].

    Returns:
        Rows (..., 3, 6): ``rows(time) @ coefficients`` is position, velocity and acceleration,
        (..., 3, J), for coefficients (6, J).
    """
    t = time if isinstance(time, float) else np.asarray(time, dtype=float)
    t2 = t * t
    t3 = t2 * t
    t4 = t3 * t
    zero = 0.0 * t
    one = zero + 1.0
    table = np.array([
        [one, t, t2, t3, t4, t4 * t],
        [zero, one, 2.0 * t, 3.0 * t2, 4.0 * t3, 5.0 * t4],
        [zero, zero, 2.0 * one, 6.0 * t, 12.0 * t2, 20.0 * t3],
    ])
    return table if table.ndim == 2 else np.moveaxis(table, (0, 1), (-2, -1))
