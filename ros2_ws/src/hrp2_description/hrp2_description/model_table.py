"""The table of links and joints in config/hrp2_links.yaml, completed.

Completion adds the left side, separates the soles from the feet, and adjusts the total mass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.yaml_files import read_yaml
from numpy.typing import NDArray

from hrp2_description.data import data_path
from hrp2_description.errors import ModelTableError

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
# Order of the robot's joints by the first part of their names.
CHAINS = ("RLEG", "LLEG", "CHEST", "HEAD", "RARM", "LARM")
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Inertial:
    """Mass and inertia of a body.

    Attributes:
        mass: Mass [kg].
        com: Position of the CoM in the link's frame, (3,) [m].
        inertia: Inertia about the CoM in the axes of the link's frame, (3, 3) [kg m^2].
    """

    mass: float
    com: NDArray[np.float64]
    inertia: NDArray[np.float64]

    def without(self, part: Inertial) -> Inertial:
        """Return the body that remains when a part is removed, by the parallel-axis theorem.

        Args:
            part: The part, in the same frame.

        Raises:
            ModelTableError: The part has the mass of the body or more.
        """
        mass = self.mass - part.mass
        if mass <= 0.0:
            raise ModelTableError("a part outweighs its whole", value=part.mass, limit=self.mass)
        com = (self.mass * self.com - part.mass * part.com) / mass
        inertia = self.inertia - part.inertia
        inertia = inertia + self.mass * _steiner(self.com)
        inertia = inertia - part.mass * _steiner(part.com) - mass * _steiner(com)
        return Inertial(mass, com, inertia)

    def scaled_to(self, mass: float) -> Inertial:
        """Return a body with another mass [kg] and the same distribution of it."""
        return Inertial(mass, self.com, self.inertia * (mass / self.mass))

    def principal_moments(self) -> NDArray[np.float64]:
        """Return the principal moments in ascending order, (3,) [kg m^2]."""
        return np.asarray(np.linalg.eigvalsh(self.inertia), dtype=np.float64)


@dataclass(frozen=True)
class Shape:
    """A geometric primitive of a link.

    Attributes:
        name: Name of the shape within its link.
        kind: ``box``, ``cylinder`` or ``sphere``.
        size: Lengths along x, y and z of a box, radius and length of a cylinder, or radius of a
            sphere [m].
        xyz: Position of the middle in the link's frame [m].
        rpy: Roll, pitch and yaw in the link's frame [rad].
        color: Name of a color in the table.
        collision: Whether the shape takes part in collisions.
    """

    name: str
    kind: str
    size: tuple[float, ...]
    xyz: Vector
    rpy: Vector
    color: str
    collision: bool


@dataclass(frozen=True)
class Link:
    """A link.

    Attributes:
        name: Name of the link.
        inertial: Mass and inertia.
        shapes: Shapes for viewers and collisions.
    """

    name: str
    inertial: Inertial
    shapes: tuple[Shape, ...]


@dataclass(frozen=True)
class Joint:
    """A revolute or fixed joint.

    Attributes:
        name: Name of the joint.
        parent: Name of the parent link.
        child: Name of the child link.
        xyz: Position of the joint in the parent's frame [m].
        axis: Axis ``x``, ``y`` or ``z`` of a revolute joint; None for a fixed joint.
        lower: Lower position limit [rad].
        upper: Upper position limit [rad].
        velocity: Largest speed [rad/s].
        effort: Largest torque [N m].
    """

    name: str
    parent: str
    child: str
    xyz: Vector
    axis: str | None = None
    lower: float = 0.0
    upper: float = 0.0
    velocity: float = 0.0
    effort: float = 0.0


@dataclass(frozen=True)
class ModelTable:
    """The whole robot.

    Attributes:
        name: Name of the robot.
        links: Links, the base first.
        joints: Revolute joints in the robot's order, then the fixed ones.
        colors: Red, green, blue and opacity of each color by its name.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    colors: dict[str, tuple[float, ...]]

    @property
    def mass(self) -> float:
        """Total mass [kg]."""
        return sum(link.inertial.mass for link in self.links)

    def link(self, name: str) -> Link:
        """Return the link of a name."""
        return next(link for link in self.links if link.name == name)


def load_model_table(path: Path | None = None) -> ModelTable:
    """Read the table and complete it.

    Args:
        path: YAML file of the table; the default is the package's own.

    Raises:
        ModelTableError: The masses do not add up, a joint's limits are in the wrong order, or no
            real body can have a link's inertia.
    """
    data = read_yaml(path or data_path("config/hrp2_links.yaml"))
    links = {name: _read_link(name, row) for name, row in data["links"].items()}
    joints = {name: _read_joint(name, row) for name, row in data["joints"].items()}
    _add_frames(data, links, joints)
    for side in list(links.values()):
        if _mirror_name(side.name) != side.name:
            links[_mirror_name(side.name)] = _mirror_link(side)
    for joint in list(joints.values()):
        if _mirror_name(joint.name) != joint.name:
            joints[_mirror_name(joint.name)] = _mirror_joint(joint)
    _fill_up(links, data["remainder_link"], float(data["total_mass"]))
    for link in links.values():
        _check_inertia(link)
    ordered = tuple(sorted(joints.values(), key=_joint_rank))
    rank = {joint.child: index for index, joint in enumerate(ordered)}
    table = tuple(sorted(links.values(), key=lambda link: rank.get(link.name, -1)))
    colors = {name: tuple(rgba) for name, rgba in data["colors"].items()}
    return ModelTable(data["name"], table, ordered, colors)


def _add_frames(data: dict[str, Any], links: dict[str, Link], joints: dict[str, Joint]) -> None:
    for name, row in data["frames"].items():
        shapes = tuple(_read_shape(shape) for shape in row.get("shapes", ()))
        xyz = _vector(row["xyz"])
        joints[f"{name}_joint"] = Joint(f"{name}_joint", row["parent"], name, xyz)
        if not name.endswith("_sole"):
            inertia = float(data["frame_mass"]) * 0.02**2 * np.eye(3)
            body = Inertial(float(data["frame_mass"]), np.zeros(3), inertia)
            links[name] = Link(name, body, shapes)
            continue
        mass = float(data["sole"]["mass"])
        if xyz != _vector(data["sole"]["parent_offset"]):
            raise ModelTableError("sole frame", value=xyz, limit=data["sole"]["parent_offset"])
        body = Inertial(mass, np.zeros(3), _box_inertia(mass, shapes[0].size))
        links[name] = Link(name, body, shapes)
        foot = links[row["parent"]]
        in_foot = Inertial(mass, np.array(xyz), body.inertia)
        links[foot.name] = replace(foot, inertial=foot.inertial.without(in_foot))


def _fill_up(links: dict[str, Link], name: str, total: float) -> None:
    link = links[name]
    others = sum(other.inertial.mass for other in links.values()) - link.inertial.mass
    if total - others < link.inertial.mass:
        raise ModelTableError(
            "the links outweigh the robot", value=others + link.inertial.mass, limit=total
        )
    links[name] = replace(link, inertial=link.inertial.scaled_to(total - others))


def _check_inertia(link: Link) -> None:
    small, middle, large = link.inertial.principal_moments()
    if small <= 0.0 or small + middle < large:
        raise ModelTableError(
            f"principal moments of {link.name} break the triangle inequality",
            value=(small, middle, large),
            limit="0 < a <= b <= c <= a + b",
        )


def _read_link(name: str, row: dict[str, Any]) -> Link:
    ixx, iyy, izz, ixy, ixz, iyz = (float(value) for value in row["inertia"])
    inertia = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    body = Inertial(float(row["mass"]), np.array(row["com"], dtype=float), inertia)
    return Link(name, body, tuple(_read_shape(shape) for shape in row.get("shapes", ())))


def _read_shape(row: dict[str, Any]) -> Shape:
    kind = next(kind for kind in ("box", "cylinder", "sphere") if kind in row)
    size = tuple(float(value) for value in np.atleast_1d(row[kind]))
    return Shape(
        name=row["name"],
        kind=kind,
        size=size,
        xyz=_vector(row["xyz"]),
        rpy=_vector(row.get("rpy", (0.0, 0.0, 0.0))),
        color=row["color"],
        collision=bool(row.get("collision", True)),
    )


def _read_joint(name: str, row: dict[str, Any]) -> Joint:
    lower, upper = (float(np.deg2rad(value)) for value in row["limits_deg"])
    if row["axis"] not in AXES or not lower < upper:
        raise ModelTableError(f"joint {name}", value=row, limit="axis x, y or z; lower < upper")
    return Joint(
        name=name,
        parent=row["parent"],
        child=row["child"],
        xyz=_vector(row["xyz"]),
        axis=row["axis"],
        lower=lower,
        upper=upper,
        velocity=float(row["velocity"]),
        effort=float(row["effort"]),
    )


def _mirror_name(name: str) -> str:
    for right, left in (("RLEG", "LLEG"), ("RARM", "LARM"), ("r_", "l_")):
        if name.startswith(right):
            return left + name[len(right) :]
    return name


def _mirror_link(link: Link) -> Link:
    flip = np.diag([1.0, -1.0, 1.0])
    body = link.inertial
    mirrored = Inertial(body.mass, flip @ body.com, flip @ body.inertia @ flip)
    shapes = tuple(
        replace(
            shape,
            xyz=_negated(shape.xyz, (1,)),
            rpy=_negated(shape.rpy, (0, 2)),
        )
        for shape in link.shapes
    )
    return Link(_mirror_name(link.name), mirrored, shapes)


def _mirror_joint(joint: Joint) -> Joint:
    # The axes keep their direction, so rotations about x and z change sign and their limits swap.
    lower, upper = joint.lower, joint.upper
    if joint.axis in ("x", "z"):
        lower, upper = -upper, -lower
    return replace(
        joint,
        name=_mirror_name(joint.name),
        parent=_mirror_name(joint.parent),
        child=_mirror_name(joint.child),
        xyz=_negated(joint.xyz, (1,)),
        lower=lower,
        upper=upper,
    )


def _joint_rank(joint: Joint) -> tuple[bool, int, str]:
    chain = joint.name.split("_", 1)[0]
    return joint.axis is None, CHAINS.index(chain) if joint.axis else 0, joint.name


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _negated(values: Vector, which: tuple[int, ...]) -> Vector:
    return _vector([0.0 - v if i in which else v for i, v in enumerate(values)])


def _steiner(offset: NDArray[np.float64]) -> NDArray[np.float64]:
    shifted: NDArray[np.float64] = offset @ offset * np.eye(3) - np.outer(offset, offset)
    return shifted


def _box_inertia(mass: float, size: tuple[float, ...]) -> NDArray[np.float64]:
    x, y, z = size
    return np.diag([y**2 + z**2, x**2 + z**2, x**2 + y**2]) * mass / 12.0
