"""Outlines of the robot's bodies, as they are seen along an axis of odom."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from humanoid_motion.clearance import bodies_of
from humanoid_motion.robot_model import RobotModel
from scipy.spatial import ConvexHull

_BASE = 1  # Pinocchio's index of the free joint
_AROUND, _UP = 48, 13  # points around a cylinder or a sphere, and from pole to pole


@dataclass(frozen=True)
class Outline:
    """A collision shape, seen along an axis.

    Attributes:
        link: That it belongs to.
        joint: Pinocchio's index of the joint that carries it.
        points: Corners of its convex outline in the axes of the view, (V, 2) [m].
        near: How near its middle is to the eye [m]; draw in this order.
    """

    link: str
    joint: int
    points: Array
    near: float


def body_outlines(robot: RobotModel, q: Array, axes: tuple[int, int], eye: Array) -> list[Outline]:
    """Outlines of every shape, the farthest first.

    Args:
        robot: The robot.
        q: Its configuration in odom.
        axes: Of odom that span the view, such as (1, 2) for y and z.
        eye: Direction from the robot to the eye, (3,).
    """
    geometry = bodies_of(robot).shapes
    data = geometry.createData()
    pin.updateGeometryPlacements(robot.model, robot.data, geometry, data, q)
    found = []
    for link, item, pose in zip(
        bodies_of(robot).links, geometry.geometryObjects, data.oMg, strict=True
    ):
        points = surface_points(item.geometry) @ pose.rotation.T + pose.translation
        flat = points[:, axes]
        near = float(eye @ points.mean(axis=0))
        corners = flat[ConvexHull(flat).vertices]
        found.append(Outline(link, int(item.parentJoint), corners, near))
    return sorted(found, key=lambda outline: outline.near)


def skeleton(robot: RobotModel, q: Array) -> Array:
    """Lines from joint to joint and from the ankles to the soles, in odom, (L, 2, 3) [m]."""
    pin.forwardKinematics(robot.model, robot.data, q)
    joints = np.array([pose.translation for pose in robot.data.oMi])
    ends = [(joints[robot.model.parents[i]], joints[i]) for i in range(_BASE + 1, len(joints))]
    for side, foot in robot.feet.items():
        ankle = joints[robot.model.getJointId(robot.config.legs[side][-1])]
        ends.append((ankle, robot.frame_position(q, foot.frame)))
    return np.array(ends)


def surface_points(shape: Any) -> Array:
    """Points of which a shape is the convex hull, in its own frame, (V, 3) [m].

    Round shapes lie outside their points by less than 1 % of their radius.
    """
    if hasattr(shape, "points"):  # the hull of a mesh
        return np.asarray(shape.points(), dtype=float).reshape(-1, 3)
    turn = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    if hasattr(shape, "halfLength"):  # a cylinder, along z
        ends = np.repeat([-shape.halfLength, shape.halfLength], _AROUND)
        return np.column_stack([np.tile(shape.radius * ring, (2, 1)), ends])
    if hasattr(shape, "radius"):  # a sphere
        rise = np.repeat(np.linspace(-0.5 * np.pi, 0.5 * np.pi, _UP), _AROUND)
        level = np.cos(rise)[:, None] * np.tile(ring, (_UP, 1))
        return shape.radius * np.column_stack([level, np.sin(rise)])
    half = np.array(shape.halfSide)  # a box
    return half * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
