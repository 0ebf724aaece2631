"""The collision shapes of a robot: boxes, cylinders, spheres, and meshes by their convex hull."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array

from humanoid_motion.robot_model import RobotModel

_ONE_PLACE = 0.05  # joints nearer to each other than this count as one place, such as a hip [m]
_ROOT = 1  # Pinocchio's index of the free joint of base_link

coal = pin.coal if hasattr(pin, "coal") else pin.hppfcl  # its name in Jazzy's Pinocchio


def load_shapes(robot: RobotModel) -> tuple[Any, tuple[str, ...]]:
    """Read the collision shapes of the robot's URDF.

    Args:
        robot: The robot; its configuration names the URDF.

    Returns:
        Pinocchio's geometry model, with meshes replaced by their convex hulls, and the names of
        the links whose meshes are left out: all links with meshes if the file of any mesh is
        missing, else none.
    """
    path, kind = robot.config.urdf_path, pin.GeometryType.COLLISION
    left_out: list[str] = []
    try:
        folders = [str(folder) for folder in path.resolve().parents]  # where package:// may be
        geometry = pin.buildGeomFromUrdf(robot.model, str(path), kind, package_dirs=folders)
    except ValueError:  # the file of a mesh is missing
        root = ElementTree.parse(path).getroot()
        for link in root.findall("link"):
            for shape in link.findall("collision"):
                if shape.find("geometry/mesh") is not None:
                    link.remove(shape)
                    left_out.append(link.attrib["name"])
        text = ElementTree.tostring(root, encoding="unicode")
        geometry = pin.buildGeomFromUrdfString(robot.model, text, kind)
    for item in geometry.geometryObjects:
        if item.geometry.getObjectType() == coal.OBJECT_TYPE.OT_BVH:
            item.geometry.buildConvexRepresentation(False)
            item.geometry = item.geometry.convex
    return geometry, tuple(dict.fromkeys(left_out))


def levers(robot: RobotModel, item: Any) -> tuple[Array, float]:
    """Bound the distance of a shape's points from the axis of each joint that moves it.

    Args:
        robot: The robot.
        item: A shape of `load_shapes`.

    Returns:
        Upper bounds in the robot's joint order, (J,) [m]; 0 for joints that do not move the shape.
        And an upper bound of the distance from base_link's origin [m].
    """
    model = robot.model
    item.geometry.computeLocalAABB()
    centre = item.placement.act(item.geometry.aabb_center)
    far = float(np.linalg.norm(centre)) + float(item.geometry.aabb_radius)
    found = np.zeros(model.nv)
    joint = int(item.parentJoint)
    while joint > _ROOT:
        found[model.joints[joint].idx_v] = far
        far += float(np.linalg.norm(model.jointPlacements[joint].translation))
        joint = int(model.parents[joint])
    return found[robot.v_index], far


def joined_bodies(model: Any, bodies: set[int]) -> set[tuple[int, int]]:
    """Find the bodies that are joined by one joint, or by several joints in one place.

    Args:
        model: Pinocchio's model.
        bodies: Indices of the joints whose bodies have shapes.

    Returns:
        Pairs (child, parent) of these indices.
    """
    joined = set()
    for body in bodies - {_ROOT}:
        joint, parent = body, int(model.parents[body])
        while parent > _ROOT and parent not in bodies:
            if np.linalg.norm(model.jointPlacements[joint].translation) > _ONE_PLACE:
                break
            joint, parent = parent, int(model.parents[parent])
        if parent in bodies:
            joined.add((body, parent))
    return joined
