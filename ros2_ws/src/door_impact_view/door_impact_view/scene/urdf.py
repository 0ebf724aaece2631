"""What a URDF shows: the shapes of its links and the tree of its joints (REP-103 units)."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array

from door_impact_view.errors import UrdfError

TURNING = ("revolute", "continuous")  # kinds of joints with an angle
SLIDING = ("prismatic",)
GREY = (0.6, 0.6, 0.6, 1.0)  # colour of a shape whose material has none
Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class Shape:
    """A visible shape of a link.

    Attributes:
        link: Name of the link.
        kind: ``box``, ``cylinder`` (along z), ``sphere`` or ``mesh``.
        size: Lengths along x, y and z of a box, radius and length of a cylinder, or radius of a
            sphere [m]; scale along x, y and z of a mesh.
        place: Position of its middle, or of the mesh's origin, in the link's frame, (3,) [m].
        orientation: Its orientation in the link's frame, quaternion w, x, y, z, (4,).
        color: Red, green, blue and opacity, from 0 to 1.
        file: Name of the mesh as the URDF gives it, such as ``package://NAME/meshes/arm.stl``;
            empty for other shapes.
    """

    link: str
    kind: str
    size: tuple[float, ...]
    place: Array
    orientation: Array
    color: Color = GREY
    file: str = ""


@dataclass(frozen=True)
class Joint:
    """A joint.

    Attributes:
        name: Name of the joint.
        parent: Name of the parent link.
        child: Name of the child link.
        place: Position of the child's frame in the parent's at position 0, (3,) [m].
        orientation: Its orientation there, quaternion w, x, y, z, (4,).
        axis: Unit axis in the child's frame, (3,).
        kind: The URDF's type of the joint, such as ``revolute`` or ``fixed``.
    """

    name: str
    parent: str
    child: str
    place: Array
    orientation: Array
    axis: Array
    kind: str


@dataclass(frozen=True)
class UrdfScene:
    """The visible part of a URDF.

    Attributes:
        name: Name of the robot.
        root: Name of the link that is no joint's child.
        links: Names of all links, parents before their children.
        joints: All joints, parents before their children.
        shapes: Shapes of all links.
    """

    name: str
    root: str
    links: tuple[str, ...]
    joints: tuple[Joint, ...]
    shapes: tuple[Shape, ...] = field(default=())


def read_urdf(text: str) -> UrdfScene:
    """Read links, joints and visible shapes of a URDF.

    Shapes without extent and shapes of a kind that URDF does not know are left out.

    Args:
        text: The URDF, as on ``/robot_description``.

    Raises:
        UrdfError: The text is no XML, a number is wrong, a joint names a link that does not
            exist, or links and joints are not one tree.
    """
    try:
        robot = ET.fromstring(text)
    except (ET.ParseError, ValueError) as error:
        raise UrdfError(f"it is no XML ({error})") from error
    if robot.tag != "robot":
        raise UrdfError(f"its first element is <{robot.tag}>, not <robot>", robot.tag)
    links = [_name(link) for link in robot.findall("link")]
    for link in links:
        if links.count(link) > 1:
            raise UrdfError(f"two links are named {link}", link)
    joints = [_joint(element) for element in robot.findall("joint")]
    root, ordered = _tree(links, joints)
    colors = _colors(robot)
    shapes = [
        shape
        for link in robot.findall("link")
        for visual in link.findall("visual")
        if (shape := _shape(_name(link), visual, colors)) is not None
    ]
    order = (root, *(joint.child for joint in ordered))
    return UrdfScene(robot.get("name", ""), root, order, tuple(ordered), tuple(shapes))


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return the quaternion (4,) of a URDF's rpy: turns about the fixed axes x, y and z [rad]."""
    cr, cp, cy = (math.cos(0.5 * angle) for angle in (roll, pitch, yaw))
    sr, sp, sy = (math.sin(0.5 * angle) for angle in (roll, pitch, yaw))
    return np.array([
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ])


def _tree(links: list[str], joints: list[Joint]) -> tuple[str, list[Joint]]:
    """Return the root link, and the joints with parents before their children."""
    known = set(links)
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in known:
                raise UrdfError(
                    f"joint {joint.name} names the link {link}, which does not exist", link)
    children = [joint.child for joint in joints]
    for link in set(children):
        if children.count(link) > 1:
            raise UrdfError(f"link {link} is the child of several joints", link)
    roots = known - set(children)
    if len(roots) > 1:
        first, second, *_ = sorted(roots)
        raise UrdfError(f"no joint connects the links {first} and {second}", first)
    if not roots:
        raise UrdfError("every link is a joint's child, so there is no root" if links
                        else "it has no link")
    below = defaultdict(list)
    for joint in joints:
        below[joint.parent].append(joint)
    (root,) = roots
    ordered: list[Joint] = []
    reached = [root]
    for link in reached:  # grows while it is read
        ordered += below[link]
        reached += [joint.child for joint in below[link]]
    if len(reached) < len(links):
        link = sorted(known - set(reached))[0]
        raise UrdfError(f"the joints of link {link} form a cycle", link)
    return root, ordered


def _joint(element: ET.Element) -> Joint:
    name = _name(element)
    ends = []
    for end in ("parent", "child"):
        found = element.find(end)
        link = "" if found is None else found.get("link", "")
        if not link:
            raise UrdfError(f"joint {name} names no {end} link", name)
        ends.append(link)
    axis = element.find("axis")
    direction = np.array([1.0, 0.0, 0.0] if axis is None  # URDF's default
                         else _numbers(axis.get("xyz", "1 0 0"), 3, f"the axis of joint {name}"))
    kind = element.get("type", "fixed")
    length = float(np.linalg.norm(direction))
    if length > 0.0:
        direction = direction / length
    elif kind in TURNING + SLIDING:
        raise UrdfError(f"the axis of joint {name} has no length", name)
    place, orientation = _origin(element, f"joint {name}")
    return Joint(name, ends[0], ends[1], place, orientation, direction, kind)


def _shape(link: str, visual: ET.Element, colors: dict[str, Color]) -> Shape | None:
    geometry = visual.find("geometry")
    solid = None if geometry is None else next(iter(geometry), None)
    if solid is None:
        return None
    what = f"a {solid.tag} of link {link}"
    file = ""
    if solid.tag == "box":
        size = _numbers(solid.get("size", ""), 3, what)
    elif solid.tag in ("cylinder", "sphere"):
        names = ("radius", "length") if solid.tag == "cylinder" else ("radius",)
        size = tuple(_numbers(solid.get(name, ""), 1, what)[0] for name in names)
    elif solid.tag == "mesh":
        size = _numbers(solid.get("scale", "1 1 1"), 3, what)
        file = solid.get("filename", "")
        if not file:
            return None
    else:
        return None
    if solid.tag != "mesh":  # a negative scale mirrors a mesh
        if min(size) < 0.0:
            raise UrdfError(f"the size of {what} is negative", min(size))
        if min(size) == 0.0:
            return None
    place, orientation = _origin(visual, what)
    material = visual.find("material")
    color = GREY
    if material is not None:
        color = _color(material) or colors.get(material.get("name", ""), GREY)
    return Shape(link, solid.tag, size, place, orientation, color, file)


def _colors(robot: ET.Element) -> dict[str, Color]:
    """Return the colours of materials by name; a material may be defined in any link."""
    found = {}
    for material in robot.iter("material"):
        color = _color(material)
        if color is not None:
            found[material.get("name", "")] = color
    return found


def _color(material: ET.Element) -> Color | None:
    color = material.find("color")
    if color is None:
        return None
    rgba = _numbers(color.get("rgba", ""), 4, f"the colour of {material.get('name', 'a material')}")
    red, green, blue, opacity = (min(max(value, 0.0), 1.0) for value in rgba)
    return red, green, blue, opacity


def _origin(element: ET.Element, what: str) -> tuple[Array, Array]:
    origin = element.find("origin")
    if origin is None:
        return np.zeros(3), quaternion_from_rpy(0.0, 0.0, 0.0)
    place = _numbers(origin.get("xyz", "0 0 0"), 3, f"the origin of {what}")
    rpy = _numbers(origin.get("rpy", "0 0 0"), 3, f"the origin of {what}")
    return np.array(place), quaternion_from_rpy(*rpy)


def _name(element: ET.Element) -> str:
    name = element.get("name", "")
    if not name:
        raise UrdfError(f"a {element.tag} has no name")
    return name


def _numbers(text: str, count: int, what: str) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in text.split())
    except ValueError:
        values = ()
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise UrdfError(f"{what} is {text[:40]!r}, must be {count} finite numbers", text[:40])
    return values
