"""Writes the URDF that both engines load: soles as boxes, elbow and hand as balls, meshes as hulls.

A mesh of a sole or an elbow meets floor or leaf at several points, each of which the engines make
as stiff as the whole surface. So a sole is a box, and elbow and hand are balls, as the planner
takes them for. All other meshes are convex hulls.
"""

from __future__ import annotations

import itertools
import math
import xml.etree.ElementTree as ET
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.files import cached
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import SIDES, RobotConfig
from humanoid_motion.pinocchio_model import collision_shapes, free_floating_model
from scipy.spatial import ConvexHull

from hrp2_sim_bridge.errors import ModelError

_OFF = 0.005  # largest distance of a sole's plane from its foot's lowest point [m]
_THICK = 0.02  # height of the box that stands for a foot [m]
_CORNERS = 64  # most corners of a hull; those of Talos and G1 lose 7.5 mm at most


@lru_cache(maxsize=8)  # convex hulls take long, and a world reads it at each reset
def simulated_urdf(robot: RobotConfig) -> Path:
    """Return the path of the URDF for the engines.

    Raises:
        ModelError: The file of a mesh is missing.
        RobotConfigError: A sole's frame is not at the lowest point of its foot.
    """
    root = ET.parse(robot.urdf_path).getroot()
    links = {link.attrib["name"]: link for link in root.findall("link")}
    model = free_floating_model(robot)
    geometry, missing = collision_shapes(model, robot)
    for side in SIDES:
        sole = robot.feet[side].sole
        if links[sole].find("collision") is None:
            joint = model.frames[model.getFrameId(sole)].parentJoint
            _require_sole(model, geometry, sole, joint)
            welded = {frame.name for frame in model.frames if frame.parentJoint == joint}
            for link in (links[name] for name in links.keys() & welded):
                for shape in link.findall("collision"):
                    link.remove(shape)
            x_min, x_max, y_min, y_max = robot.soles[side]
            middle = 0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.5 * _THICK
            _add_shape(links[sole], "box", middle, size=(x_max - x_min, y_max - y_min, _THICK))
    for name, radius in (
            (robot.contact_link, robot.contact_radius), (robot.hand_link, robot.hand_radius)):
        if radius is not None and links[name].find("collision/geometry/sphere") is None:
            _add_shape(links[name], "sphere", (0.0, 0.0, 0.0), radius=(radius,))
    hulls = {item.name: _obj(np.asarray(item.geometry.points()))
             for item in geometry.geometryObjects if hasattr(item.geometry, "points")}
    for link_name, link in links.items():
        for index, shape in enumerate(link.findall("collision")):
            mesh, name = shape.find("geometry/mesh"), f"{link_name}_{index}"
            if mesh is not None and missing:
                raise ModelError(robot.name, ", ".join(missing), "a file for each mesh",
                                 "links whose meshes are missing")
            if mesh is not None:
                mesh.attrib = {"filename": str(cached(f"{name}.obj", hulls[name]))}
    return cached("simulated.urdf", ET.tostring(root, encoding="unicode"))


def _add_shape(
    link: ET.Element, kind: str, place: tuple[float, ...], **numbers: tuple[float, ...]
) -> None:
    shape = ET.SubElement(link, "collision")
    ET.SubElement(shape, "origin", xyz=_text(place), rpy="0 0 0")
    ET.SubElement(ET.SubElement(shape, "geometry"), kind, {
        name: _text(values) for name, values in numbers.items()})


def _require_sole(model: Any, geometry: Any, sole: str, joint: int) -> None:
    """Refuse a sole whose plane is not that of the lowest point of its foot's shapes."""
    place, lowest = model.frames[model.getFrameId(sole)].placement, math.inf
    for item in geometry.geometryObjects:
        if item.parentJoint == joint:
            if hasattr(item.geometry, "points"):
                points = np.asarray(item.geometry.points())
            else:
                item.geometry.computeLocalAABB()
                box = item.geometry.aabb_local
                points = np.array([*itertools.product(*zip(box.min_, box.max_, strict=True))])
            pose = place.actInv(item.placement)
            lowest = min(lowest, float((points @ pose.rotation[2] + pose.translation[2]).min()))
    if lowest < math.inf and abs(lowest) > _OFF:
        raise RobotConfigError(
            f"lowest point of the foot below {sole} [m]", value=round(lowest, 4),
            limit=f"0, up to {_OFF:g} m from it: name or add the frame of the sole (frames)")


def _obj(points: Array) -> str:
    """Write a convex hull with the corners that are outermost in evenly spread directions."""
    index = np.arange(_CORNERS) + 0.5
    z, turn = 1.0 - 2.0 * index / _CORNERS, np.pi * (1.0 + 5.0**0.5) * index  # a golden spiral
    flat = np.sqrt(1.0 - z**2)
    directions = np.stack([flat * np.cos(turn), flat * np.sin(turn), z])
    corners = np.unique(points[(points @ directions).argmax(axis=0)], axis=0)
    hull = ConvexHull(corners)
    lines = [f"v {_text(corner)}" for corner in corners.tolist()]
    for (a, b, c), normal in zip(hull.simplices.tolist(), hull.equations[:, :3], strict=True):
        outward = np.cross(corners[b] - corners[a], corners[c] - corners[a]) @ normal > 0.0
        lines.append(f"f {a + 1} {b + 1} {c + 1}" if outward else f"f {a + 1} {c + 1} {b + 1}")
    return "\n".join(lines) + "\n"


def _text(numbers: tuple[float, ...] | list[float]) -> str:
    return " ".join(map(repr, numbers))
