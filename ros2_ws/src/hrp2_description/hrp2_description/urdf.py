"""Reads a robot's URDF, refuses what no robot can be, and writes it in one form for all readers.

Only the elements <link> and <joint> below <robot> count: a block for a simulator may have others of
the same names. The error of a number that belongs to another unit asks for that unit.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.files import cached, read_file

from hrp2_description.data import data_path, package_file
from hrp2_description.errors import RobotConfigError
from hrp2_description.quantities import LARGEST
from hrp2_description.robot_types import Frame

FIXED = ("fixed", "floating", "planar")  # types of joints without a limited range
_MASSES = (1.0, 1000.0)  # of a humanoid [kg]
_GYRATION = 2.0  # largest radius of gyration of a link, one of 7 m [m]
_DENSEST = 22600.0  # osmium [kg/m^3]
_ROUNDING = 0.01  # share of the largest moment of inertia that counts as rounded digits
_TINY = 1e-6  # share of the largest moment of inertia, or that of a ball, that counts as 0
# How many numbers attributes of links and joints have; others that are read have one.
_COUNTS = {"xyz": 3, "rpy": 3, "size": 3, "scale": 3, "radius": 1, "length": 1}
_FRAME = """<robot><link name="{0}"/><joint name="{0}_joint" type="fixed"><parent link="{1}"/>
<child link="{0}"/><origin xyz="{2}" rpy="{3}"/></joint></robot>"""
# Simulators give a link without inertia one kilogram.
_WEIGHTLESS = """<inertial><mass value="1e-9"/>
<inertia ixx="1e-12" ixy="0" ixz="0" iyy="1e-12" iyz="0" izz="1e-12"/></inertial>"""
_TURN = 2.01 * math.pi  # largest angle of an origin [rad]
_UNIT = 1e-3  # largest deviation of an axis' length
_FASTEST, _STRONGEST = 60.0, 5000.0  # limits of joints that are improbable [rad/s], [N m]
# Differences of links of the two legs that are improbable: of the centre [m]; of the rest, a share.
_ASKEW, _UNLIKE = 0.02, 0.1


class Urdf:
    """A URDF: a tree of links and joints.

    Args:
        path: The file. A root that only bears a floating joint is left out.
        frames: Frames of links that are added to it, by name.

    Attributes:
        path: The file.
        links: Elements of the links by name.
        joints: Elements of the joints by name.
        tree: Names of joint, parent link and child link of all joints, from the root outwards.

    Raises:
        InputError: The file cannot be read.
        RobotConfigError: Links and joints are no tree, or a length is in millimetres.
    """

    def __init__(self, path: Path, frames: Mapping[str, Frame] | None = None) -> None:
        """Read the file."""
        self.path = path
        self._text = read_file(path)
        self._robot = robot = ET.fromstring(self._text)
        for joint in robot.findall("joint[@type='floating']"):
            world = robot.find(f"link[@name='{_end('', joint, 'parent')}']")
            if world is not None and world.find("inertial") is None:
                robot.remove(joint)
                robot.remove(world)
        for name, frame in (frames or {}).items():
            robot.extend(ET.fromstring(_FRAME.format(
                name, frame.link, *(" ".join(map(repr, part)) for part in (frame.xyz, frame.rpy)))))
        self.links, self.joints = (_by_name(robot.findall(kind)) for kind in ("link", "joint"))
        self.tree = self._from_the_root()
        for name, element in [*self.links.items(), *self.joints.items()]:
            for part in element.iter():
                read = {key: _numbers(part, key, f"{part.tag} {key} in {name}")
                        for key in part.attrib if key in _COUNTS}
                if part.tag == "origin" and np.linalg.norm(read.get("xyz", 0.0)) > LARGEST:
                    raise RobotConfigError(f"origin in {name} [m]", value=read["xyz"],
                                           limit=f"{LARGEST:g} m at most (mm?)")
                if max(map(abs, read.get("rpy", [0.0]))) > _TURN:
                    raise RobotConfigError(f"origin rpy in {name} [rad]", value=read["rpy"],
                                           limit="up to 2 pi (degrees?)")

    def _from_the_root(self) -> list[tuple[str, str, str]]:
        ends = {name: (_end(name, joint, "parent"), _end(name, joint, "child"))
                for name, joint in self.joints.items()}
        reached = set(self.links) - {child for _, child in ends.values()}
        tree: list[tuple[str, str, str]] = []
        while found := [name for name, (parent, _) in ends.items() if parent in reached]:
            tree += [(name, *ends[name]) for name in found]
            reached |= {ends.pop(name)[1] for name in found}
        if ends or len(tree) != len(self.links) - 1 or reached != set(self.links):
            raise RobotConfigError(
                "joints of the URDF", value=sorted(ends) or len(tree),
                limit=f"a tree of all {len(self.links)} links with one root")
        return tree

    def written(self, moving: Sequence[str]) -> Path:
        """Return the path of the URDF that every reader gets.

        All joints that do not move are fixed in it, all links have an inertia, and its meshes have
        absolute paths. Where the file differs from that, another one is written.

        Args:
            moving: Names of the joints that move.
        """
        for name, joint in self.joints.items():
            if name not in moving and joint.attrib["type"] != "fixed":
                joint.attrib["type"] = "fixed"
                for part in joint.findall("limit") + joint.findall("mimic"):
                    joint.remove(part)
        for link in self.links.values():
            if link.find("inertial") is None:
                link.append(ET.fromstring(_WEIGHTLESS))
        for mesh in self._robot.iter("mesh"):
            mesh.attrib["filename"] = str(self._mesh(mesh.attrib["filename"]))
        text = ET.tostring(self._robot, encoding="unicode")
        if text == ET.tostring(ET.fromstring(self._text), encoding="unicode"):
            return self.path
        return cached(f"{self.path.stem}.urdf", text)

    def _mesh(self, name: str) -> Path | str:
        """Return the path of a mesh's file, or its name where there is no such file."""
        folders = self.path.resolve().parents
        places = [folders[0] / name.removeprefix("file://")]
        if name.startswith("package://"):  # of a package that is not installed, too
            places = [folder / name.removeprefix("package://").lstrip("/") for folder in folders]
        found = next((path for path in places if path.is_file()), None)
        return found or package_file(name) or name

    def frame(self, joint: str) -> tuple[list[float], list[float], list[float]]:
        """Return the origin xyz [m] and rpy [rad] of a joint in its parent link, and its axis."""
        element = self.joints[joint]
        origin, axis = element.find("origin"), element.find("axis")
        return (_numbers(origin, "xyz", default="0 0 0"), _numbers(origin, "rpy", default="0 0 0"),
                _numbers(axis, "xyz", default="1 0 0"))

    def mass(self, moving: Sequence[str]) -> float:
        """Return the mass of all links [kg].

        Args:
            moving: Names of the joints that move; the links at the others are welded together.

        Raises:
            RobotConfigError: A link is no body that can be: its mass is negative, it has a
                principal moment of inertia that is negative, or larger than the two others
                together, or none for its mass. Or what moving joints move has no mass or moments,
                or the whole mass is not that of a humanoid.
        """
        bodies = {name: name for name in self.links}
        for joint, parent, child in self.tree:
            bodies[child] = child if joint in moving else bodies[parent]
        solid, total, masses = set(), 0.0, dict.fromkeys(self.links, 0.0)
        for name, link in self.links.items():
            mass, moments = _inertial(name, link)
            total += mass
            masses[bodies[name]] += mass
            if moments[0] > 0.0:
                solid.add(bodies[name])
        hollow = [f"{child} ({masses[child]:g} kg)" for joint, _, child in self.tree
                  if joint in moving and child not in solid]
        if hollow:  # legs of point masses would be planned for, wrongly
            raise RobotConfigError(
                "links behind moving joints, with what is fixed to them, without inertia",
                value=", ".join(hollow), limit="a mass and three positive principal moments each")
        least, most = _MASSES
        if not least <= total <= most:
            raise RobotConfigError(
                "mass of all links [kg]", value=total,
                limit=f"{least:g} to {most:g} kg (grams, tonnes?)")
        return total

    def limits(self, names: Sequence[str], others: str | None) -> Array:
        """Return lower limit, upper limit, largest speed and largest torque of joints, (J, 4).

        Args:
            names: Names of the joints.
            others: "fixed" if the URDF may have other joints, too.

        Raises:
            RobotConfigError: The joints differ from those of the URDF, are not of the type
                revolute, or have no limits that a joint can have.
        """
        joints = {name for name, each in self.joints.items() if each.attrib["type"] not in FIXED}
        different = set(names) - joints if others else set(names) ^ joints
        if different or len(set(names)) != len(names):
            raise RobotConfigError(
                "joint_names and the URDF's joints differ",
                value=sorted(different),
                limit="joints of the URDF, each of them once" if others else "the same set",
            )
        return np.array([_limits(name, self.joints[name]) for name in names])


def find_urdf(name: str, config_file: Path) -> Path:
    """Return the path of the URDF that a robot.yaml names.

    Raises:
        RobotConfigError: There is no such file.
    """
    places = [config_file.parent / name, config_file.parent.parent / name, data_path(name)]
    for path in (*places, package_file(name)):
        if path is not None and path.is_file():
            return path
    raise RobotConfigError(
        "there is no URDF", value=name,
        limit=f"a file in the folder of {config_file}, or package:// and an installed package")


def doubts(
    urdf: Urdf, names: Sequence[str], limits: Array, legs: Mapping[str, Sequence[str]]
) -> tuple[str, ...]:
    """Return sentences about what is possible and improbable in a URDF.

    Args:
        urdf: The URDF.
        names: Names of the joints.
        limits: Their limits, as `Urdf.limits` returns them.
        legs: Names of the joints of the ``left`` and the ``right`` leg.
    """
    found = []
    for column, most, unit in ((2, _FASTEST, "rad/s (deg/s?)"), (3, _STRONGEST, "N m (N mm?)")):
        over = np.flatnonzero(limits[:, column] > most)
        if over.size:
            found.append(f"the URDF allows {names[over[0]]} {limits[over[0], column]:g} {unit}")
    children = {joint: child for joint, _, child in urdf.tree}
    for pair in zip(legs["left"], legs["right"], strict=False):
        left, right = (children.get(joint, "") for joint in pair)
        if left and right and not _mirrored(urdf.links[left], urdf.links[right]):
            found.append(f"mass, its centre or inertia of {left} is not that of {right} mirrored")
    return tuple(found)


def _mirrored(left: ET.Element, right: ET.Element) -> bool:
    """Whether the inertial data of two links of legs, whose axes are parallel, are alike."""
    rows = []
    for link in (left, right):
        inertial = link.find("inertial")
        origin = None if inertial is None else inertial.find("origin")
        if inertial is None or any(_numbers(origin, "rpy", default="0 0 0")):
            return True  # cannot be told
        rows.append(np.array([
            *_numbers(origin, "xyz", default="0 0 0"), *_mass_and_inertia("", inertial)]))
    one, other = rows
    other = other * [1, -1, 1, 1, 1, -1, 1, 1, -1, 1]
    # Tolerances of x, y, z, of the mass, and of the inertia.
    spread = [*[_ASKEW] * 3, _UNLIKE * one[3], *[_UNLIKE * np.abs(one[4:]).max()] * 6]
    return bool((np.abs(one - other) <= spread).all())


def _by_name(elements: Sequence[ET.Element]) -> Mapping[str, ET.Element]:
    found: dict[str, ET.Element] = {}
    for element in elements:
        if element.attrib["name"] in found:
            raise RobotConfigError(
                f"{element.tag} in the URDF", value=f"{element.attrib['name']} twice",
                limit="one of each name")
        found[element.attrib["name"]] = element
    return found


def _end(name: str, joint: ET.Element, kind: str) -> str:
    link = joint.find(kind)
    if link is None:
        raise RobotConfigError(f"joint {name}", value=f"no {kind}", limit="a parent and a child")
    return link.attrib["link"]


def _numbers(
    element: ET.Element | None, key: str, what: str = "", default: str = "none"
) -> list[float]:
    text = default if element is None else element.attrib.get(key, default)
    count = _COUNTS.get(key, 1)
    try:
        numbers = [float(each) for each in text.replace("_", "?").split()]
        if len(numbers) == count and all(map(math.isfinite, numbers)):
            return numbers
    except ValueError:
        pass
    raise RobotConfigError(what, value=text, limit="a finite number" if count == 1 else
                           f"{count} finite numbers with spaces between, without units")


def _inertial(name: str, link: ET.Element) -> tuple[float, Array]:
    """Return mass [kg] and principal moments (3,) [kg m^2] of a link, zeros for a mere frame."""
    inertial = link.find("inertial")
    if inertial is None:
        return 0.0, np.zeros(3)
    mass, xx, xy, xz, yy, yz, zz = _mass_and_inertia(name, inertial)
    moments: Array = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    # A frame may have no mass, and a point mass no moments; both must be fixed to a body.
    ball = 0.4 * mass * (0.75 * max(mass, 0.0) / (math.pi * _DENSEST)) ** (2.0 / 3.0)
    moments[np.abs(moments) < _TINY * max(np.abs(moments).max(), ball)] = 0.0
    least, middle, most = moments.tolist()
    limit = ""
    if not mass >= 0.0 or (mass == 0.0 and most != 0.0):
        limit = "a mass above 0"
    elif least < 0.0 or least + middle < (1.0 - _ROUNDING) * most:
        limit = "moments of 0 or more, none above the sum of the two others"
    elif most > _GYRATION**2 * mass:
        limit = f"a radius of gyration of at most {_GYRATION:g} m (kg mm^2, or g?)"
    elif 0.0 < most < ball:
        limit = f"{ball:.3g} kg m^2, the moment of a ball of the densest metal, or more (g?)"
    if limit:
        raise RobotConfigError(
            f"mass [kg] and principal moments of inertia [kg m^2] of {name}",
            value=(mass, *(float(f"{each:.4g}") for each in moments)), limit=limit)
    return mass, moments


def _mass_and_inertia(name: str, inertial: ET.Element) -> list[float]:
    return [_numbers(inertial.find("mass"), "value", f"mass of {name}")[0], *(
        _numbers(inertial.find("inertia"), key, f"{key} of {name}")[0]
        for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))]


def _limits(name: str, joint: ET.Element) -> list[float]:
    kind = joint.attrib["type"]
    if kind != "revolute" or joint.find("mimic") is not None:
        raise RobotConfigError(
            f"joint {name} has a type that cannot be used", value=kind,
            limit="revolute, without mimic")
    axis = _numbers(joint.find("axis"), "xyz", default="1 0 0")
    if abs(float(np.linalg.norm(axis)) - 1.0) > _UNIT:
        raise RobotConfigError(f"axis of {name}", value=axis, limit="a vector of length 1")
    lower, upper, velocity, effort = (
        _numbers(joint.find("limit"), key, f"limit {key} of {name}")[0]
        for key in ("lower", "upper", "velocity", "effort"))
    if not lower < upper:
        raise RobotConfigError(f"limits of {name} [rad]", value=(lower, upper), limit="lower first")
    if max(-lower, upper) > 2.0 * math.pi:
        raise RobotConfigError(
            f"limits of {name} [rad]", value=(lower, upper), limit="up to 2 pi (degrees?)")
    for key, value in (("velocity", velocity), ("effort", effort)):
        if not value > 0.0:
            raise RobotConfigError(
                f"limit {key} of {name}", value=value, limit="a number above 0")
    return [lower, upper, velocity, effort]
