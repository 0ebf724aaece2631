"""Where the leaf is: points on its face at an opening angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LeafFrame:
    """The leaf at an opening angle.

    Attributes:
        hinge: x and y of the hinge in odom, (2,) [m]; it lies in the plane of the face.
        angle: Opening angle [rad].
    """

    hinge: Array
    angle: float

    @property
    def along(self) -> Array:
        """From the hinge to the free edge, (3,)."""
        return np.array([math.cos(self.angle), -math.sin(self.angle), 0.0])

    @property
    def normal(self) -> Array:
        """Of the face, into the door, (3,)."""
        return np.array([-math.sin(self.angle), -math.cos(self.angle), 0.0])

    def gap(self, point: Array) -> float:
        """Distance of a point from the face, positive on the robot's side [m]."""
        return float(self.normal[:2] @ (self.hinge - np.asarray(point)[:2]))

    def radius(self, point: Array) -> float:
        """Distance of a point from the hinge, along the leaf [m]."""
        return float(self.along[:2] @ (np.asarray(point)[:2] - self.hinge))

    def point(self, radius: float, height: float, gap: float) -> Array:
        """Point at a distance from the hinge, a height and a distance from the face, (3,) [m]."""
        place = np.append(self.hinge, height)
        return place + radius * self.along - gap * self.normal
