"""Read a URDF by yourdfpy: shapes of its links as meshes, and its joints."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import trimesh
import yourdfpy
from door_impact_common.arrays import Array
from hrp2_description.data import package_file
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from door_impact_view.errors import UrdfError

TURNING = ("revolute", "continuous")  # kinds of joints with an angle
SLIDING = ("prismatic",)


@dataclass(frozen=True)
class Shape:
    """A visible shape of a link.

    Attributes:
        link: Name of the link.
        mesh: Its surface in the link's frame [m].
    """

    link: str
    mesh: trimesh.Trimesh

    @property
    def place(self) -> Array:
        """Middle of its bounding box in the link's frame, (3,) [m]."""
        return np.asarray(self.mesh.bounds.mean(axis=0))

    @property
    def color(self) -> tuple[int, ...]:
        """Red, green, blue and opacity, from 0 to 255."""
        visual: Any = self.mesh.visual
        return tuple(int(value) for value in getattr(visual, "material", visual).main_color)


@dataclass(frozen=True)
class Joint:
    """A joint.

    Attributes:
        name: Name of the joint.
        parent: Name of the parent link.
        child: Name of the child link.
        kind: The URDF's type of the joint, such as ``revolute`` or ``fixed``.
        origin: Pose of the child's frame in the parent's at position 0, (4, 4) [m].
        axis: Unit axis in the child's frame, (3,).
    """

    name: str
    parent: str
    child: str
    kind: str
    origin: Array
    axis: Array


@dataclass(frozen=True)
class UrdfScene:
    """The visible part of a URDF.

    Attributes:
        urdf: yourdfpy's model, for forward kinematics and for viser.
        root: Name of the link that is no joint's child.
        joints: All joints.
        shapes: Shapes of all links.
        note: Sentence about meshes that are left out; empty if none is.
    """

    urdf: yourdfpy.URDF
    root: str
    joints: tuple[Joint, ...]
    shapes: tuple[Shape, ...]
    note: str = ""

    @property
    def links(self) -> tuple[str, ...]:
        """Names of all links."""
        return tuple(self.urdf.link_map)


@lru_cache(maxsize=4)  # reports read the same description again and again
def read_urdf(text: str) -> UrdfScene:
    """Read links, joints and visible shapes of a URDF.

    Args:
        text: The URDF, as on ``/robot_description``.

    Raises:
        UrdfError: The text is no URDF, or a mesh in it is damaged.
    """
    try:
        robot = yourdfpy.URDF.load(io.BytesIO(text.encode()), build_scene_graph=False,
                                   load_meshes=False).robot
        return _scene_of(robot)
    except UrdfError:
        raise
    except Exception as error:  # yourdfpy and the readers of meshes raise whatever they like
        raise UrdfError(" ".join(f"{type(error).__name__}: {error}".split())) from error


def _scene_of(robot: yourdfpy.Robot) -> UrdfScene:
    """Return what a robot shows.

    Args:
        robot: The robot as yourdfpy has parsed it; its shapes get other names, and its joints unit
            axes.

    Raises:
        UrdfError: There is no root link, or a number is not finite.
    """
    missing: list[str] = []

    def is_there(visual: Any) -> bool:
        mesh = visual.geometry.mesh
        if mesh is not None and package_file(mesh.filename) is None:
            missing.append(mesh.filename)
            return False
        return True

    for link in robot.links:
        link.visuals = [*filter(is_there, link.visuals)]  # yourdfpy would print each that is not
        for number, visual in enumerate(link.visuals):
            visual.name = f"shape {number} of {link.name}"  # viser needs names that no link has
    urdf = yourdfpy.URDF(robot, filename_handler=lambda fname: str(package_file(fname)))
    if urdf.base_link is None:
        raise UrdfError("it has no link that is no joint's child")
    joints = tuple(_joint(joint) for joint in robot.joints)
    graph = urdf.scene.graph
    shapes = []
    for name in graph.nodes_geometry:
        mesh = urdf.scene.geometry[name]
        link = graph.transforms.parents[name]
        _make_transparent(mesh)
        shapes.append(Shape(link, mesh.copy().apply_transform(urdf.get_transform(name, link))))
    numbers = [*(joint.origin for joint in joints), *(joint.axis for joint in joints),
               *(shape.mesh.vertices for shape in shapes)]
    if not all(np.isfinite(each).all() for each in numbers):
        raise UrdfError("a number in it is not finite")
    note = ("" if not missing else f"{len(missing)} meshes of the URDF are not in an installed "
            f"package and are left out, the first is {missing[0]}.")
    return UrdfScene(urdf, urdf.base_link, joints, tuple(shapes), note)


def _joint(joint: Any) -> Joint:
    origin = np.eye(4) if joint.origin is None else joint.origin
    length = float(np.linalg.norm(joint.axis))
    if length > 0.0:
        joint.axis = joint.axis / length  # yourdfpy slides along an axis of any length
    elif joint.type in TURNING + SLIDING:
        raise UrdfError(f"the axis of joint {joint.name} has no length")
    return Joint(joint.name, joint.parent, joint.child, joint.type, origin, joint.axis)


def _make_transparent(mesh: trimesh.Trimesh) -> None:
    """Give a mesh whose one colour is transparent a material that glTF draws so."""
    visual: Any = mesh.visual
    if visual.kind == "face" and visual.main_color[3] < 255:
        mesh.visual = TextureVisuals(
            material=PBRMaterial(baseColorFactor=visual.main_color, alphaMode="BLEND"))
