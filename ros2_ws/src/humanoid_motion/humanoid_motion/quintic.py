"""The quintic polynomial on [0, 1]: its coefficients from both ends, and its values.

ros2_control's JointTrajectoryController joins two points that carry positions, velocities and
accelerations with a quintic. A segment that lasts h seconds becomes one on [0, 1] by scaling
velocities with h and accelerations with h^2.
"""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

# Coefficients from value, first and second derivative at 0, then the same three at 1.
_FROM_ENDS = np.array([
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
    [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
    [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
    [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
])


def quintic(*ends: Array) -> Array:
    """Compute the quintic on [0, 1] that has given values and derivatives at both ends.

    Args:
        ends: Value, first and second derivative at 0, then value, first and second derivative at
            1; six arrays of the same shape (...).

    Returns:
        Coefficients of the powers 0 to 5, (6, ...).
    """
    return np.tensordot(_FROM_ENDS, np.array(ends), axes=1)


def rows(x: ArrayLike) -> Array:
    """Compute the rows that turn coefficients into value, first and second derivative.

    Args:
        x: Places on [0, 1], (...).

    Returns:
        Rows (..., 3, 6): ``rows(x) @ coefficients`` is the value, the first and the second
        derivative at x, (..., 3, J), for coefficients (6, J).
    """
    x = x if isinstance(x, float) else np.asarray(x, dtype=float)
    x2 = x * x
    x3 = x2 * x
    x4 = x3 * x
    zero = 0.0 * x
    one = zero + 1.0
    table = np.array([
        [one, x, x2, x3, x4, x4 * x],
        [zero, one, 2.0 * x, 3.0 * x2, 4.0 * x3, 5.0 * x4],
        [zero, zero, 2.0 * one, 6.0 * x, 12.0 * x2, 20.0 * x3],
    ])
    return table if table.ndim == 2 else np.moveaxis(table, (0, 1), (-2, -1))
