"""Rectangles on the floor: their corners, and how far they stand apart."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.support import sole_corners

Rectangle = tuple[float, float, float, float]
"""x_min, x_max, y_min, y_max in the rectangle's own frame [m]."""


def corners(rectangle: Rectangle, poses: Array) -> Array:
    """Compute the corners of a rectangle at poses, (N, 4, 2) [m].

    Args:
        rectangle: The rectangle.
        poses: x, y [m] and yaw [rad] of its frame, (N, 3).
    """
    local = sole_corners(rectangle, np.zeros(3))
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([np.stack([cos, -sin], axis=1), np.stack([sin, cos], axis=1)], axis=1)
    return np.asarray(np.einsum("nij,cj->nci", turn, local) + poses[:, None, :2])


def gaps(one: Rectangle, poses: Array, two: Rectangle, others: Array) -> Array:
    """Compute the signed distances between rectangles, (N,) [m].

    The distance is the largest gap along the normals of the rectangles' edges. It is negative where
    they overlap, and at most the true distance where they do not.

    Args:
        one: The first rectangle.
        poses: x, y [m] and yaw [rad] of its frame, (N, 3).
        two: The second rectangle.
        others: x, y [m] and yaw [rad] of its frame, (N, 3) or (1, 3).
    """
    between = _middles(one, poses) - _middles(two, others)
    turn = poses[:, 2] - others[:, 2]
    straight, across = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    found = np.full(len(poses), -np.inf)
    for own, other, heading in ((_half(one), _half(two), poses[:, 2]),
                                (_half(two), _half(one), others[:, 2])):
        cos, sin = np.cos(heading), np.sin(heading)
        along = np.abs(cos * between[:, 0] + sin * between[:, 1])
        aside = np.abs(cos * between[:, 1] - sin * between[:, 0])
        found = np.maximum(found, along - own[0] - straight * other[0] - across * other[1])
        found = np.maximum(found, aside - own[1] - across * other[0] - straight * other[1])
    return found


def _half(rectangle: Rectangle) -> tuple[float, float]:
    x_min, x_max, y_min, y_max = rectangle
    return 0.5 * (x_max - x_min), 0.5 * (y_max - y_min)


def _middles(rectangle: Rectangle, poses: Array) -> Array:
    x_min, x_max, y_min, y_max = rectangle
    x, y = 0.5 * (x_min + x_max), 0.5 * (y_min + y_max)
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack([
        poses[:, 0] + cos * x - sin * y, poses[:, 1] + sin * x + cos * y])
