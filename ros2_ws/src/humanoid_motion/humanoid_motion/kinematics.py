"""Homogeneous poses (4, 4): inverse, poses on the floor, heading, rows for messages."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array


def inverse_pose(pose: Array) -> Array:
    """Return the inverse (4, 4) of a homogeneous pose (4, 4)."""
    inverse = np.eye(4)
    inverse[:3, :3] = pose[:3, :3].T
    inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return inverse


def planar_pose(x: float, y: float, yaw: float) -> Array:
    """Return the pose (4, 4) of a frame on the floor at x, y [m], turned about z by yaw [rad]."""
    pose = np.eye(4)
    cos, sin = np.cos(yaw), np.sin(yaw)
    pose[:2, :2] = [[cos, -sin], [sin, cos]]
    pose[:2, 3] = x, y
    return pose


def yaw_of(pose: Array) -> float:
    """Return the heading of a pose's x axis, its angle about the vertical [rad]."""
    return float(np.arctan2(pose[1, 0], pose[0, 0]))


def pose_row(pose: Array) -> Array:
    """Return a pose (4, 4) as its position x, y, z [m] and quaternion x, y, z, w, (7,)."""
    return np.array(pin.SE3ToXYZQUAT(pin.SE3(pose[:3, :3].copy(), pose[:3, 3].copy())))
