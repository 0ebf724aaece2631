"""The door for viewers: its URDF, and the poses of its frames door_frame and door_leaf.

The origin of ``door_frame`` is the point where the hinge axis meets the floor. Its axes are
parallel to those of odom, and the face of the closed leaf lies in its plane y = 0. ``door_leaf``
has the same origin and turns about -z when the door opens, about z if it is hinged at the left.
"""

import math
import xml.etree.ElementTree as ET

from door_model.door.config import DoorConfig
from door_model.door.frame import frame_boxes
from door_model.door.geometry import Hinge, along

FRAME, LEAF, JOINT = "door_frame", "door_leaf", "door_hinge"
# One sees what happens behind the wall.
_COLORS = {
    "wood": "0.72 0.53 0.35 1", "frame": "0.45 0.45 0.48 1", "wall": "0.88 0.88 0.86 0.4"}

Pose = tuple[float, float, float, float, float, float, float]
"""Position x, y, z [m] and orientation as a quaternion x, y, z, w."""

Triple = tuple[float, float, float]


def frame_pose(door_distance: float, hinge_x: float, hinge: Hinge = "right") -> Pose:
    """Return the pose of door_frame in odom.

    Args:
        door_distance: Distance from the origin of odom to the closed leaf's face, along -y [m].
        hinge_x: x of a hinge at the right in odom, -x of one at the left [m].
        hinge: Side of the hinge.
    """
    return along(hinge) * hinge_x, -door_distance, 0.0, 0.0, 0.0, 0.0, 1.0


def leaf_pose(angle: float, hinge: Hinge = "right") -> Pose:
    """Return the pose of door_leaf in door_frame.

    Args:
        angle: Opening angle of the door [rad].
        hinge: Side of its hinge.
    """
    turn = -0.5 * along(hinge) * angle
    return 0.0, 0.0, 0.0, 0.0, 0.0, math.sin(turn), math.cos(turn)


def door_urdf(door: DoorConfig) -> str:
    """Make the URDF of a door.

    The leaf, wall, jamb, lintel and threshold have visual and collision shapes. What does not move
    belongs to the link door_frame. Of a door without a known frame there is the leaf alone.

    Args:
        door: The door.
    """
    robot = ET.Element("robot", name=f"door_{door.name}")
    for name, color in _COLORS.items():
        ET.SubElement(ET.SubElement(robot, "material", name=name), "color", rgba=color)
    frame = ET.SubElement(robot, "link", name=FRAME)
    for box in [] if door.frame is None else frame_boxes(
            door.leaf, door.frame, hinge=door.hinge):
        color = "wall" if box.name.startswith("wall") else "frame"
        _add_box(frame, "visual", box.size, box.center, color, box.name)
        _add_box(frame, "collision", box.size, box.center, name=box.name)
    leaf = ET.SubElement(robot, "link", name=LEAF)
    size = (door.leaf.width, door.leaf.thickness, door.leaf.height)
    x, y, z = door.leaf.center()
    center = along(door.hinge) * x, y, z
    _add_box(leaf, "visual", size, center, "wood")
    _add_box(leaf, "collision", size, center)
    joint = ET.SubElement(robot, "joint", name=JOINT, type="revolute")
    ET.SubElement(joint, "parent", link=FRAME)
    ET.SubElement(joint, "child", link=LEAF)
    ET.SubElement(joint, "axis", xyz=f"0 0 {-along(door.hinge):g}")
    widest = f"{door.linkage.opening_limit():.6f}"
    # URDF requires limits of effort and velocity; a door has none.
    ET.SubElement(joint, "limit", lower="0", upper=widest, effort="0", velocity="0")
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


def _add_box(link: ET.Element, kind: str, size: Triple, center: Triple, color: str = "",
             name: str = "") -> None:
    part = ET.SubElement(link, kind, {"name": name} if name else {})
    ET.SubElement(part, "origin", xyz=_text(center), rpy="0 0 0")
    ET.SubElement(ET.SubElement(part, "geometry"), "box", size=_text(size))
    if color:
        ET.SubElement(part, "material", name=color)


def _text(numbers: Triple) -> str:
    return " ".join(f"{number:.6g}" for number in numbers)
