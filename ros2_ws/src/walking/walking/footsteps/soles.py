"""Distances between the rectangles of the two soles."""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig
from hrp2_description.support import sole_corners

from walking.footsteps.footstep import other


def sole_distances(robot: RobotConfig, side: str, placed: Array, standing: Array) -> Array:
    """Compute the signed distances between a sole and the other one, (N,) [m].

    The distance is the largest gap along the normals of the rectangles' edges. It is negative where
    the soles overlap, and at most the true distance where they do not.

    Args:
        robot: The robot.
        side: Side of the first sole.
        placed: x, y [m] and yaw [rad] of the first sole, (N, 3).
        standing: The same of the other sole, (N, 3).
    """
    one, two = _corners(robot, side, placed), _corners(robot, other(side), standing)
    gap = np.full(len(placed), -np.inf)
    for heading in (placed[:, 2], standing[:, 2]):
        for turn in (0.0, 0.5 * math.pi):
            normal = np.stack([np.cos(heading + turn), np.sin(heading + turn)], axis=1)
            a = np.einsum("nci,ni->nc", one, normal)
            b = np.einsum("nci,ni->nc", two, normal)
            apart = np.maximum(a.min(axis=1) - b.max(axis=1), b.min(axis=1) - a.max(axis=1))
            gap = np.maximum(gap, apart)
    return gap


def _corners(robot: RobotConfig, side: str, poses: Array) -> Array:
    local = sole_corners(robot.soles[side], np.zeros(3))
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([np.stack([cos, -sin], axis=1), np.stack([sin, cos], axis=1)], axis=1)
    return np.asarray(np.einsum("nij,cj->nci", turn, local) + poses[:, None, :2])
