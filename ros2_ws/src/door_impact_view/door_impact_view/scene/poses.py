"""Compute poses: turns by unit quaternions (w, x, y, z), links of a URDF, places on the floor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from door_impact_common.arrays import Array

from door_impact_view.scene.urdf import UrdfScene

FLAT = 0.004  # height of points and polygons on the floor, above its grid [m]
RAISED = 0.04  # height of the capture point, on which the ZMP lies while the robot stands [m]


def rotate(quaternion: Array, vector: Array) -> Array:
    """Return vectors (..., 3) turned by quaternions (..., 4)."""
    w, u = quaternion[..., :1], quaternion[..., 1:]
    twice = 2.0 * np.cross(u, vector)
    return np.asarray(vector + w * twice + np.cross(u, twice))


def link_poses(
    scene: UrdfScene, positions: Mapping[str, float]
) -> dict[str, tuple[Array, Array]]:
    """Return the pose of every link in the root link's frame (forward kinematics).

    Args:
        scene: Links and joints.
        positions: Position of joints by name [rad] or [m]; a joint that is not in it is at 0.

    Returns:
        Places (3,) [m] and rotation matrices (3, 3) by link.
    """
    urdf = scene.urdf
    urdf.update_cfg({name: float(positions.get(name, 0.0)) for name in urdf.actuated_joint_names})
    poses = {link: urdf.get_transform(link) for link in scene.links}
    return {link: (pose[:3, 3], pose[:3, :3]) for link, pose in poses.items()}


def on_floor(places: Array, height: float = FLAT) -> Array:
    """Return places (N, 2) on the floor as places (N, 3) at a height above it [m]."""
    return np.column_stack([places, np.full(len(places), height)])
