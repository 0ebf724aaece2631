"""Where what belongs to the floor is drawn: above it, so that the floor's grid does not hide it."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array

FLAT = 0.004  # height of points and polygons on the floor [m]
RAISED = 0.04  # height of the capture point, on which the ZMP lies while the robot stands [m]


def on_floor(places: Array, height: float = FLAT) -> Array:
    """Return places (N, 2) on the floor as places (N, 3) at a height above it [m]."""
    return np.column_stack([places, np.full(len(places), height)])
