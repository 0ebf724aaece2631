"""Orientations as quaternions, and the poses of a URDF's links.

Quaternions are (w, x, y, z) and of length 1. The functions take arrays with any number of leading
dimensions.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from door_impact_common.arrays import Array

from door_impact_view.scene.urdf import SLIDING, TURNING, Joint, UrdfScene

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def axis_angle(axis: Array, angle: Array | float) -> Array:
    """Return the quaternions (..., 4) of turns about unit axes (..., 3) by angles (...) [rad]."""
    half = 0.5 * np.asarray(angle, dtype=np.float64)[..., None]
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)


def product(first: Array, second: Array) -> Array:
    """Return the quaternions (..., 4) of `second` followed by `first`, as matrices multiply."""
    a, b = first[..., :1], second[..., :1]
    u, v = first[..., 1:], second[..., 1:]
    real = a * b - np.sum(u * v, axis=-1, keepdims=True)
    return np.concatenate([real, a * v + b * u + np.cross(u, v)], axis=-1)


def rotate(quaternion: Array, vector: Array) -> Array:
    """Return vectors (..., 3) turned by quaternions (..., 4)."""
    w, u = quaternion[..., :1], quaternion[..., 1:]
    twice = 2.0 * np.cross(u, vector)
    return np.asarray(vector + w * twice + np.cross(u, twice))


def joint_pose(joint: Joint, position: Array | float) -> tuple[Array, Array]:
    """Return the pose of a joint's child link in the parent link.

    Args:
        joint: The joint; one that is neither turning nor sliding does not move.
        position: Positions of the joint, (...) [rad] or [m].

    Returns:
        Places (..., 3) [m] and orientations (..., 4).
    """
    moved = np.asarray(position, dtype=np.float64)
    place = np.broadcast_to(joint.place, (*moved.shape, 3))
    turn = np.broadcast_to(joint.orientation, (*moved.shape, 4))
    if joint.kind in TURNING:
        turn = product(turn, axis_angle(joint.axis, moved))
    elif joint.kind in SLIDING:
        place = place + rotate(turn, joint.axis * moved[..., None])
    return place, turn


def link_poses(
    scene: UrdfScene, positions: Mapping[str, Array | float]
) -> dict[str, tuple[Array, Array]]:
    """Return the pose of every link in the root link's frame (forward kinematics).

    Args:
        scene: Links and joints.
        positions: Position of joints by name, (...) [rad] or [m]; a joint that is not in it is
            at 0.

    Returns:
        Places (..., 3) [m] and orientations (..., 4) by link.
    """
    poses = {scene.root: (np.zeros(3), IDENTITY)}
    for joint in scene.joints:  # parents come before their children
        place, turn = poses[joint.parent]
        offset, rotation = joint_pose(joint, positions.get(joint.name, 0.0))
        poses[joint.child] = (place + rotate(turn, offset), product(turn, rotation))
    return poses
