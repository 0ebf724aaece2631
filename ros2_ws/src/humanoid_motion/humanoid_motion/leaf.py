"""Geometry of the leaf at an opening angle: its directions, and distances from its face."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from door_impact_common.arrays import Array


@dataclass(frozen=True)
class LeafFrame:
    """The leaf at an opening angle, or at several.

    Attributes:
        hinge: x and y of the hinge in odom, (2,) [m]. The hinge lies in the plane of the face.
        angle: Opening angle, a number or (N,) [rad].
    """

    hinge: Array
    angle: float | Array

    @cached_property
    def along(self) -> Array:
        """Unit vector from the hinge to the free edge in odom, (3,) or (N, 3)."""
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return np.stack([cosine, -sine, np.zeros_like(sine)], axis=-1)

    @cached_property
    def normal(self) -> Array:
        """Unit normal of the face in odom, pointing into the door, (3,) or (N, 3)."""
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return np.stack([-sine, -cosine, np.zeros_like(sine)], axis=-1)

    def gap(self, point: Array) -> Array:
        """Compute how far points (3,) or (N, 3) are from the face, on the robot's side [m]."""
        return self._across(self.normal, self.hinge - point[..., :2])

    def radius(self, point: Array) -> Array:
        """Compute how far points (3,) or (N, 3) are from the hinge, along the leaf [m]."""
        return self._across(self.along, point[..., :2] - self.hinge)

    def point(self, radius: float, height: float, gap: float) -> Array:
        """Compute the point at given distances from hinge and face, in odom.

        Args:
            radius: Distance from the hinge along the leaf [m].
            height: Height above the floor [m].
            gap: Distance from the face, positive on the robot's side [m].

        Returns:
            The point for each opening angle, (3,) or (N, 3) [m].
        """
        return np.append(self.hinge, height) + radius * self.along - gap * self.normal

    @staticmethod
    def _across(direction: Array, offset: Array) -> Array:
        """Compute the horizontal component of offsets along directions [m]."""
        product: Array = direction[..., 0] * offset[..., 0] + direction[..., 1] * offset[..., 1]
        return product
