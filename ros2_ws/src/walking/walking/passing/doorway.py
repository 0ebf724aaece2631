"""The doorway on the floor: the wall on both sides, and the leaf at its angle.

The door's frame has its origin where the hinge axis meets the floor. In odom the closed leaf
extends from the hinge along x; its face lies towards y, and the leaf opens towards -y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from door_impact_common.arrays import Array
from door_model.door.frame import THRESHOLD, FixedBox, frame_boxes
from door_model.door.geometry import Frame, Leaf

from walking.footsteps.rectangles import Rectangle, corners, gaps

_BESIDE = ("wall_hinge_side", "wall_free_side", "jamb")


@dataclass(frozen=True)
class Doorway:
    """A leaf in the frame of a wall.

    Attributes:
        hinge: x and y of the hinge in odom, (2,) [m].
        leaf: The leaf.
        frame: Frame and wall.

    Raises:
        DoorParameterError: The leaf does not fit into the frame.
    """

    hinge: Array
    leaf: Leaf
    frame: Frame

    def __post_init__(self) -> None:
        """Check that the leaf fits into the frame."""
        self.frame.require_around(self.leaf)

    @property
    def far_face(self) -> float:
        """y of the wall's face beyond the door in odom [m]."""
        return float(self.hinge[1]) + self.frame.depth - self.frame.wall_thickness

    @property
    def free_jamb(self) -> float:
        """Distance of the jamb at the free edge from the hinge, along the closed leaf [m]."""
        return 0.5 * (self.leaf.width + self.frame.width)

    @cached_property
    def boxes(self) -> tuple[FixedBox, ...]:
        """Everything of the frame and the wall that stands still, in odom."""
        x, y = (float(value) for value in self.hinge)
        return tuple(frame_boxes(self.leaf, self.frame, (x, y, 0.0)))

    def obstacles(self) -> list[FixedBox]:
        """Return what a body may run into beside the leaf: everything but a threshold."""
        return [box for box in self.boxes if box.name != THRESHOLD]

    @cached_property
    def _walls(self) -> tuple[Rectangle, ...]:
        return tuple(_seen_from_above(box) for box in self.boxes if box.name in _BESIDE)

    @cached_property
    def threshold(self) -> FixedBox | None:
        """The threshold, over which the robot steps; None: there is none."""
        return next((box for box in self.boxes if box.name == THRESHOLD), None)

    def middle_line(self, angle: float) -> float:
        """Distance of the line midway between leaf and free jamb from the leaf's face [m].

        Args:
            angle: Opening angle of the leaf [rad].
        """
        return 0.5 * (self.free_jamb * float(np.sin(angle))
                      - self.frame.depth * float(np.cos(angle)))

    def wall_gaps(
        self, rectangle: Rectangle, poses: Array, within: float = math.inf
    ) -> Array:
        """Compute the distance of a rectangle at poses (N, 3) from walls and jambs, (N,) [m].

        It is that of `rectangles.gaps`: negative inside.

        Args:
            rectangle: The rectangle.
            poses: x, y [m] and yaw [rad] of its frame, (N, 3).
            within: Larger distances than this may be infinite in the answer, which saves time [m].
        """
        still, found = np.zeros((1, 3)), np.full(len(poses), np.inf)
        reach = within + math.hypot(*np.abs(rectangle).reshape(2, 2).max(axis=1))
        for x_min, x_max, y_min, y_max in self._walls:
            apart = np.maximum(np.abs(poses[:, 0] - 0.5 * (x_min + x_max)) - 0.5 * (x_max - x_min),
                               np.abs(poses[:, 1] - 0.5 * (y_min + y_max)) - 0.5 * (y_max - y_min))
            near = apart <= reach
            found[near] = np.minimum(found[near], gaps(
                rectangle, poses[near], (x_min, x_max, y_min, y_max), still))
        return found

    def threshold_gaps(self, rectangle: Rectangle, poses: Array) -> Array:
        """Compute the distance of a rectangle at poses (N, 3) from the threshold, (N,) [m].

        It is that of `rectangles.gaps`, and infinite where there is no threshold.
        """
        if self.threshold is None:
            return np.full(len(poses), np.inf)
        return gaps(rectangle, poses, _seen_from_above(self.threshold), np.zeros((1, 3)))

    def leaf_gaps(self, rectangle: Rectangle, poses: Array, angles: Array) -> Array:
        """Compute the distance of a rectangle at poses (N, 3) from the leaf, (N,) [m].

        Args:
            rectangle: The rectangle.
            poses: x, y [m] and yaw [rad] of its frame, (N, 3).
            angles: Opening angles of the leaf, (N,) [rad].
        """
        leaf = np.column_stack([np.tile(self.hinge, (len(angles), 1)), -angles])
        return gaps(rectangle, poses, (0.0, self.leaf.width, -self.leaf.thickness, 0.0), leaf)

    def clear_by(self, rectangle: Rectangle, poses: Array) -> Array:
        """Compute how far a rectangle is beyond the wall and outside the leaf's circle, (N,) [m].

        Args:
            rectangle: The rectangle.
            poses: x, y [m] and yaw [rad] of its frame, (N, 3).
        """
        body = corners(rectangle, poses)
        beyond = self.far_face - body[..., 1].max(axis=1)
        outside = _distance_from(self.hinge, body) - np.hypot(self.leaf.width, self.leaf.thickness)
        return np.minimum(beyond, outside)


def _seen_from_above(box: FixedBox) -> Rectangle:
    (x, y, _), (half_x, half_y, _) = box.center, box.half
    return x - half_x, x + half_x, y - half_y, y + half_y


def _distance_from(point: Array, body: Array) -> Array:
    """Distance of rectangles' edges (N, 4, 2) from a point outside them, (N,) [m]."""
    begin, along = body - point, np.roll(body, -1, axis=1) - body
    part = -np.einsum("nci,nci->nc", begin, along) / np.einsum("nci,nci->nc", along, along)
    nearest = begin + part.clip(0.0, 1.0)[..., None] * along
    return np.asarray(np.hypot(nearest[..., 0], nearest[..., 1]).min(axis=1))
