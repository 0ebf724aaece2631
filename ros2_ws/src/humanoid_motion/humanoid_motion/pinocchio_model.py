"""What Pinocchio reads from a robot's URDF: the only reader of the URDF in this package."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import RobotConfig
from numpy.typing import NDArray

FLIP = np.array([1.0, -1.0, 1.0])
"""Factors of a vector's reflection in the plane y = 0 of a frame of the robot."""
_SAME = 1e-3  # largest difference of twins' places [m], and of entries of rotations and axes

coal = pin.coal if hasattr(pin, "coal") else pin.hppfcl  # its name in Jazzy's Pinocchio


def free_floating_model(config: RobotConfig) -> Any:
    """Build Pinocchio's model of a robot whose base_link is free to move.

    Args:
        config: Configuration that names the URDF and its joints.

    Returns:
        The model, of type ``pinocchio.Model``. Its joint 1, ``root_joint``, is the free base: q
        begins with the position [m] and the quaternion (x, y, z, w) of base_link in the world,
        v with the linear [m/s] and angular [rad/s] velocity of base_link in its own axes. The
        robot's joints follow in the URDF's order, which may differ from `RobotConfig.joint_names`.

    Raises:
        ValueError: The URDF cannot be read.
    """
    model = pin.buildModelFromUrdf(str(config.urdf_path), pin.JointModelFreeFlyer())
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])  # Pinocchio's own default is 9.81
    return model


def joint_columns(
    model: Any, names: Sequence[str]
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return where joints, given by their names, stand in Pinocchio's q and v, (J,) each."""
    joints = [model.joints[model.getJointId(name)] for name in names]
    return np.array([joint.idx_q for joint in joints]), np.array([joint.idx_v for joint in joints])


def inertia_beyond(model: Any, joint: str) -> Any:
    """Sum the inertias of what hangs rigidly on a fixed joint, in the frame of the moving body."""
    first = model.getFrameId(joint)
    below, total = {first}, model.frames[first].placement.act(model.frames[first].inertia)
    for number in range(first + 1, model.nframes):  # parents come first
        frame = model.frames[number]
        if frame.parentFrame in below and frame.parentJoint == model.frames[first].parentJoint:
            below.add(number)
            total = total + frame.placement.act(frame.inertia)
    return total


def find_twins(model: Any) -> tuple[NDArray[np.int_], Array]:
    """Find each joint's mirror image in the plane y = 0 of base_link, by places and axes alone.

    Args:
        model: Model of `free_floating_model`.

    Returns:
        For each of Pinocchio's joints the number of its twin, itself for universe, base and joints
        of the trunk, and the sign that an angle gets in the mirror: -1 for HRP-2's joints about x
        and z.

    Raises:
        RobotConfigError: A joint has no twin: the robot is not symmetric within 1 mm.
    """
    data, count = model.createData(), model.njoints
    pin.computeJointJacobians(model, data, pin.neutral(model))
    place, turn = (np.array([getattr(pose, part) for pose in data.oMi])
                   for part in ("translation", "rotation"))
    image = FLIP[:, None] * turn * FLIP
    axis = np.zeros((count, 3))
    axis[2:] = data.J[3:, [joint.idx_v for joint in list(model.joints)[2:]]].T
    align = (-FLIP * axis) @ axis.T  # an axis of rotation is an axial vector
    same = ((np.abs(FLIP * place - place[:, None]).max(axis=2) < _SAME)
            & (np.abs(image - turn[:, None]).max(axis=(2, 3)) < _SAME)
            & (np.abs(align) > 1.0 - _SAME))
    same[:2, :2] = np.eye(2, dtype=bool)
    lost = np.flatnonzero(same.sum(axis=0) != 1)
    if lost.size:
        raise RobotConfigError(
            "the robot has no mirror image", value=[model.names[int(joint)] for joint in lost],
            limit="one joint at the mirrored place of each")
    twin = same.argmax(axis=0)
    return twin, np.where(align[np.arange(count), twin] < 0.0, -1.0, 1.0)


def link_tree(config: RobotConfig) -> tuple[tuple[str, str], ...]:
    """Read the names (parent, child) of the links that each joint of the URDF joins."""
    frames = pin.buildModelFromUrdf(str(config.urdf_path)).frames
    bodies = [frame for frame in frames if frame.type == pin.FrameType.BODY and frame.parentFrame]
    # The parent of a body's frame is its joint's frame.
    return tuple((frames[frames[body.parentFrame].parentFrame].name, body.name) for body in bodies)


def collision_shapes(model: Any, config: RobotConfig) -> tuple[Any, tuple[str, ...]]:
    """Read the boxes, cylinders, spheres and meshes with which bodies collide.

    Args:
        model: Model of `free_floating_model`.
        config: Configuration that names the URDF.

    Returns:
        Pinocchio's geometry model, with meshes replaced by their convex hulls, and the names of
        the links whose meshes are left out: all links with meshes if the file of any mesh is
        missing, else none.
    """
    path, kind = config.urdf_path, pin.GeometryType.COLLISION
    left_out: list[str] = []
    try:
        geometry = pin.buildGeomFromUrdf(model, str(path), kind)
    except ValueError:  # the file of a mesh is missing
        root = ElementTree.parse(path).getroot()
        for link in root.findall("link"):
            for shape in link.findall("collision"):
                if shape.find("geometry/mesh") is not None:
                    link.remove(shape)
                    left_out.append(link.attrib["name"])
        text = ElementTree.tostring(root, encoding="unicode")
        geometry = pin.buildGeomFromUrdfString(model, text, kind)
    for item in geometry.geometryObjects:
        if item.geometry.getObjectType() == coal.OBJECT_TYPE.OT_BVH:
            item.geometry.buildConvexRepresentation(False)
            item.geometry = item.geometry.convex
    return geometry, tuple(dict.fromkeys(left_out))
