"""The zero-moment point (ZMP) of a force and a moment, and its distance from the soles' edges.

The ZMP is the point of the floor about which the contact forces have no horizontal moment
(Vukobratovic and Borovac, "Zero-moment point - thirty-five years of its life", 2004; Kajita et al.,
"Introduction to Humanoid Robotics", 2014, section 3.2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.support import polygon_margin, support_polygon
from numpy.typing import ArrayLike

from humanoid_motion.robot_model import RobotModel


def zmp_of(force: ArrayLike, moment: ArrayLike, height: float = 0.0) -> Array:
    """Compute the ZMP from the whole force and moment of the floor on the robot.

    Setting the horizontal part of moment - p x force to zero with p_z = height gives
    p_x = (p_z f_x - m_y) / f_z and p_y = (p_z f_y + m_x) / f_z.

    Args:
        force: Force of the floor on the robot, z upwards, (..., 3) [N].
        moment: Moment of the floor on the robot about the origin, (..., 3) [N m].
        height: Height of the floor above the origin [m].

    Returns:
        x and y of the ZMP, (..., 2) [m]; NaN where the floor does not push (f_z <= 0).
    """
    f, m = np.asarray(force, dtype=float), np.asarray(moment, dtype=float)
    normal = np.where(f[..., 2] > 0.0, f[..., 2], np.nan)
    x = (height * f[..., 0] - m[..., 1]) / normal
    y = (height * f[..., 1] + m[..., 0]) / normal
    return np.stack([x, y], axis=-1)


def margins(
    robot: RobotModel,
    zmp: Array,
    feet: dict[str, Array],
    sides: Sequence[str],
    feet_yaw: Mapping[str, float] | None = None,
) -> Array:
    """Compute the distance of the ZMP to the nearest edge of the support polygon.

    Args:
        zmp: x and y of the ZMP in odom, (N, 2) [m].
        feet: Positions of the soles that bear load in odom, by side, (3,) each [m].
        sides: Sides of the soles that bear load.
        feet_yaw: Headings of these soles in odom, by side [rad]; None means parallel to odom.

    Returns:
        Distances (N,) [m]: positive inside, negative outside, minus infinity where the ZMP is NaN.
    """
    yaw = feet_yaw or dict.fromkeys(sides, 0.0)
    hull = support_polygon(*(robot.feet[side].corners(feet[side], yaw[side]) for side in sides))
    distance = np.asarray(polygon_margin(zmp, hull), dtype=float)
    return np.where(np.isnan(distance), -np.inf, distance)


def edge_margin(zmp: Array, edges: tuple[float, float]) -> Array:
    """Compute the smallest distance of each course of the ZMP along y from two edges.

    Args:
        zmp: y of the ZMP in odom, one course or several, (..., N) [m].
        edges: Lower and upper y of the soles in odom [m].

    Returns:
        Distances (...) [m], negative where a course leaves the edges.
    """
    return np.minimum(zmp.min(axis=-1) - edges[0], edges[1] - zmp.max(axis=-1))
