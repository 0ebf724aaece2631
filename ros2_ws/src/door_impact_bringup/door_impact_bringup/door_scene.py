"""The door for viewers: its URDF, and the poses of its frames door_frame and door_leaf.

The origin of ``door_frame`` is the point where the hinge axis meets the floor. Its axes are
parallel to those of odom, and the face of the closed leaf lies in its plane y = 0. ``door_leaf``
has the same origin and turns about -z when the door opens, as in the simulation.
"""

import math
import xml.etree.ElementTree as ET

from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig

FRAME, LEAF, JOINT = "door_frame", "door_leaf", "door_hinge"
_POST = 0.08  # width of posts and lintel [m]
_GAP = 0.01   # gap between the leaf and the posts and lintel [m]
_COLORS = {"wood": "0.72 0.53 0.35 1", "frame": "0.45 0.45 0.48 1"}

Pose = tuple[float, float, float, float, float, float, float]
"""Position x, y, z [m] and orientation as a quaternion x, y, z, w."""

Triple = tuple[float, float, float]


def frame_pose(door_distance: float, hinge_x: float) -> Pose:
    """Return the pose of door_frame in odom.

    Args:
        door_distance: Distance from the origin of odom to the closed leaf's face, along -y [m].
        hinge_x: x of the hinge in odom [m].

    Raises:
        SettingError: A number is not finite.
    """
    for name, value in (("door_distance", door_distance), ("hinge_x", hinge_x)):
        if not math.isfinite(value):
            raise SettingError(name, value, "the place of the door, a finite number of metres")
    return hinge_x, -door_distance, 0.0, 0.0, 0.0, 0.0, 1.0


def leaf_pose(angle: float) -> Pose:
    """Return the pose of door_leaf in door_frame.

    Args:
        angle: Opening angle of the door [rad].
    """
    return 0.0, 0.0, 0.0, 0.0, 0.0, -math.sin(0.5 * angle), math.cos(0.5 * angle)


def door_urdf(door: DoorConfig) -> str:
    """Make the URDF of a door.

    The leaf has a visual and a collision shape; posts and lintel are there to be looked at only.

    Args:
        door: The door.
    """
    robot = ET.Element("robot", name=f"door_{door.name}")
    for name, color in _COLORS.items():
        ET.SubElement(ET.SubElement(robot, "material", name=name), "color", rgba=color)
    frame = ET.SubElement(robot, "link", name=FRAME)
    for size, center in _frame_boxes(door):
        _add_box(frame, "visual", size, center, "frame")
    leaf = ET.SubElement(robot, "link", name=LEAF)
    size = (door.leaf.width, door.leaf.thickness, door.leaf.height)
    _add_box(leaf, "visual", size, door.leaf.center(), "wood")
    _add_box(leaf, "collision", size, door.leaf.center())
    joint = ET.SubElement(robot, "joint", name=JOINT, type="revolute")
    ET.SubElement(joint, "parent", link=FRAME)
    ET.SubElement(joint, "child", link=LEAF)
    ET.SubElement(joint, "axis", xyz="0 0 -1")
    widest = f"{door.linkage.opening_limit():.6f}"
    # URDF requires limits of effort and velocity; a door has none.
    ET.SubElement(joint, "limit", lower="0", upper=widest, effort="0", velocity="0")
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


def _frame_boxes(door: DoorConfig) -> list[tuple[Triple, Triple]]:
    """Return size and centre of both posts and of the lintel, in door_frame [m]."""
    leaf = door.leaf
    _, depth_center, middle = leaf.center()
    top = middle + 0.5 * leaf.height + _GAP
    # The leaf's corner at the hinge swings back by the leaf's thickness.
    left, right = -leaf.thickness - _GAP, leaf.width + _GAP
    post = (_POST, leaf.thickness, top)
    lintel = (right - left + 2.0 * _POST, leaf.thickness, _POST)
    return [
        (post, (left - 0.5 * _POST, depth_center, 0.5 * top)),
        (post, (right + 0.5 * _POST, depth_center, 0.5 * top)),
        (lintel, (0.5 * (left + right), depth_center, top + 0.5 * _POST)),
    ]


def _add_box(link: ET.Element, kind: str, size: Triple, center: Triple, color: str = "") -> None:
    part = ET.SubElement(link, kind)
    ET.SubElement(part, "origin", xyz=_text(center), rpy="0 0 0")
    ET.SubElement(ET.SubElement(part, "geometry"), "box", size=_text(size))
    if color:
        ET.SubElement(part, "material", name=color)


def _text(numbers: Triple) -> str:
    return " ".join(f"{number:.6g}" for number in numbers)
