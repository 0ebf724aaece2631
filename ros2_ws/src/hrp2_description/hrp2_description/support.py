"""The support polygon of the soles, and the distance of a point from its edges."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

from hrp2_description.errors import DegeneratePolygonError

Point = tuple[float, float]
MIN_AREA = 1e-6  # area below which a polygon counts as a line: one square millimetre [m^2]
# Points are rounded to a nanometre, because an edge between equal points has no direction.
DECIMALS = 9
_CONVEX_TOLERANCE = 1e-12  # rounding error of the cross product of two edges [m^2]


def sole_corners(rect: tuple[float, float, float, float], pose: ArrayLike) -> Array:
    """Return the corners of a sole on the floor, counter-clockwise.

    Args:
        rect: Rectangle (x_min, x_max, y_min, y_max) in the sole's frame [m].
        pose: Pose of the sole in the world, as a homogeneous matrix (4, 4) or as x, y and yaw,
            (3,) [m, m, rad].

    Returns:
        x and y of the corners in the world, (4, 2) [m].

    Raises:
        ValueError: The pose has another shape.
    """
    x_min, x_max, y_min, y_max = rect
    local = np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]])
    placed = np.asarray(pose, dtype=float)
    if placed.shape == (4, 4):
        corners: Array = local @ placed[:2, :2].T + placed[:2, 3]
    elif placed.shape == (3,):
        cos, sin = np.cos(placed[2]), np.sin(placed[2])
        corners = local @ np.array([[cos, sin], [-sin, cos]]) + placed[:2]
    else:
        raise ValueError(f"pose must have shape (4, 4) or (3,), not {placed.shape}")
    return corners


def support_polygon(*points: ArrayLike) -> Array:
    """Return the convex hull of points on the floor.

    Args:
        points: Arrays of points (N, 2) [m], for example one for each sole that bears load.

    Returns:
        Corners (M, 2) [m], counter-clockwise, rounded to a nanometre. No corner lies on a straight
        edge.

    Raises:
        DegeneratePolygonError: The points span no area or are not finite.
    """
    arrays = [np.asarray(array, dtype=float).reshape(-1, 2) for array in points]
    cloud = np.concatenate(arrays) if arrays else np.empty((0, 2))
    if not np.isfinite(cloud).all():
        raise DegeneratePolygonError("points are not finite", value=cloud, limit="finite numbers")
    ordered = sorted(set(map(tuple, (np.round(cloud, DECIMALS) + 0.0).tolist())))
    hull = np.array(_half_hull(ordered) + _half_hull(ordered[::-1])).reshape(-1, 2)
    area = _area(hull) if len(hull) >= 3 else 0.0
    if area < MIN_AREA:
        raise DegeneratePolygonError("the points span no area", value=area, limit=MIN_AREA)
    return hull


def polygon_margin(points: ArrayLike, hull: ArrayLike) -> Array:
    """Return the signed distance of points from the nearest edge of a convex polygon.

    Args:
        points: Points (..., 2) [m].
        hull: Corners of the polygon, counter-clockwise, as `support_polygon` returns them,
            (M, 2) [m].

    Returns:
        Distances (...) [m]: positive inside, zero on an edge, negative outside; NaN for a point
        with NaN.

    Raises:
        DegeneratePolygonError: The polygon spans no area, is clockwise, is not convex, or has a
            corner twice.
    """
    corners = _checked_hull(hull)
    place = np.asarray(points, dtype=float)[..., None, :] - corners
    edges = _following(corners) - corners
    lengths = np.linalg.norm(edges, axis=1)
    # Signed distance from the line through each edge, positive on its left; then from the edge.
    left = (edges[:, 0] * place[..., 1] - edges[:, 1] * place[..., 0]) / lengths
    along = np.clip(np.sum(place * edges, axis=-1) / lengths**2, 0.0, 1.0)
    away = np.linalg.norm(place - along[..., None] * edges, axis=-1)
    inside = left.min(axis=-1)
    margin: Array = np.where(inside < 0.0, -away.min(axis=-1), inside)
    return margin


def _half_hull(ordered: list[Point]) -> list[Point]:
    # Andrew's monotone chain (1979); the last point belongs to the other half.
    chain: list[Point] = []
    for point in ordered:
        while len(chain) >= 2 and _turn(chain[-2], chain[-1], point) <= 0.0:
            chain.pop()
        chain.append(point)
    return chain[:-1]


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _following(rows: Array) -> Array:
    return np.concatenate((rows[1:], rows[:1]))


def _area(polygon: Array) -> float:
    after = _following(polygon)
    return float(0.5 * (polygon[:, 0] @ after[:, 1] - polygon[:, 1] @ after[:, 0]))


def _checked_hull(hull: ArrayLike) -> Array:
    corners = np.asarray(hull, dtype=float)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
        raise DegeneratePolygonError("no polygon", value=corners.shape, limit="(M >= 3, 2)")
    area = _area(corners)
    if not area >= MIN_AREA:
        raise DegeneratePolygonError(
            "the polygon is degenerate or clockwise", value=area, limit=MIN_AREA
        )
    edges = _following(corners) - corners
    shortest = float(np.linalg.norm(edges, axis=1).min())
    if shortest < 0.1 * 10.0**-DECIMALS:
        raise DegeneratePolygonError("corners coincide", value=shortest, limit=10.0**-DECIMALS)
    after = _following(edges)
    turns = edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0]
    if turns.min() < -_CONVEX_TOLERANCE:
        raise DegeneratePolygonError(
            "the polygon is not convex", value=float(turns.min()), limit=0.0
        )
    return corners
