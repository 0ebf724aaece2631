"""Outlines of the robot's bodies, seen along an axis of odom."""

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
_AROUND = 48  # number of points around a cylinder or a sphere
_UP = 13  # number of circles from pole to pole of a sphere


@dataclass(frozen=True)
class Outline:
    """A collision shape, seen along an axis.

    Attributes:
        link: Name of the link that the shape belongs to.
        joint: Pinocchio's index of the joint that moves the shape.
        points: Corners of the convex outline in the axes of the view, (V, 2) [m].
        near: Coordinate of the shape's middle towards the eye [m]; nearer shapes are drawn later.
    """

    link: str
    joint: int
    points: Array
    near: float


def body_outlines(robot: RobotModel, q: Array, axes: tuple[int, int], eye: Array) -> list[Outline]:
    """Outlines of all shapes, the farthest first.

    Args:
        robot: The robot.
        q: Configuration of the robot in odom.
        axes: Indices of odom's axes that span the view, such as (1, 2) for y and z.
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
    """Lines from joint to joint and from the ankles to the soles in odom, (L, 2, 3) [m].

    The last lines are those to the soles.
    """
    pin.forwardKinematics(robot.model, robot.data, q)
    joints = np.array([pose.translation for pose in robot.data.oMi])
    ends = [(joints[robot.model.parents[i]], joints[i]) for i in range(_BASE + 1, len(joints))]
    for side, foot in robot.feet.items():
        ankle = joints[robot.model.getJointId(robot.config.legs[side][-1])]
        ends.append((ankle, robot.frame_position(q, foot.frame)))
    return np.array(ends)


def surface_points(shape: Any) -> Array:
    """Points whose convex hull is a given shape, in the shape's frame, (V, 3) [m].

    A round shape exceeds the hull of its points by less than 1 % of its radius.
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
