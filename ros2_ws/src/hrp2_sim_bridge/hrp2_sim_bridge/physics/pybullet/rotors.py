"""Rotor inertia, which PyBullet does not have, approximated by additional inertia of the links.

A rotor of inertia J behind a gear of ratio N adds A = N^2 J to its joint's diagonal entry of the
mass matrix and changes no other entry (Featherstone, "Rigid Body Dynamics Algorithms", 2008,
section 9.6). An inertia A about the joint's axis on one of the joint's two links adds the same, but
also resists every other turn of that link about this axis. Therefore `robot.yaml` names a link for
each rotor (`rotor_link`): the link that turns when the robot sways on its feet while the joint's
other link keeps its orientation. This is the child link of hips and knees and the parent link of
ankles. docs/physics.md compares the resulting effective masses with the exact ones.
"""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig, needed

from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.frames import rotation

_ENTRIES = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2),
            "izz": (2, 2)}
# Bullet replaces an inertia that violates the triangle inequality by zero, and the inertia of a
# link with a rotor does. A link is therefore loaded with these moments [kg m^2] about the wanted
# principal axes and receives its own moments afterwards.
_STAND_IN = np.array([1.0, 1.1, 1.2])
_TOLERANCE = 1e-3  # largest product of inertia that may be lost, as a share of the largest moment


def link_inertias(robot: RobotConfig, rotor_scale: float) -> dict[str, Array]:
    """Compute the inertias of all links with their rotors.

    Args:
        robot: Configuration of the robot.
        rotor_scale: Multiple of the rotors' inertia; 0 means no rotors.

    Returns:
        Inertia (3, 3) [kg m^2] about each link's CoM, in the link's axes, by the link's name.

    Raises:
        RobotConfigError: The configuration has no `rotor_link`.
    """
    root = ET.parse(robot.urdf_path).getroot()
    inertias = {link.attrib["name"]: _read(link) for link in root.findall("link")}
    armature = dict(zip(robot.joint_names, robot.armature, strict=True))
    rotor_link = needed(robot.rotor_link, "rotor_link")
    for joint in root.findall("joint"):
        side = rotor_link.get(joint.attrib["name"])
        if side is not None:
            link = _named(joint, side).attrib["link"]
            # The URDF's joint frames are parallel to the frames of their parent links, so the axis
            # has the same components in both links.
            axis = np.array(_named(joint, "axis").attrib["xyz"].split(), dtype=float)
            added = rotor_scale * armature[joint.attrib["name"]] * np.outer(axis, axis)
            inertias[link] = inertias[link] + added
    return inertias


def load_robot(client: Any, robot: RobotConfig, rotor_scale: float) -> int:
    """Load the robot with the rotors' inertia on its links.

    Args:
        client: Client of PyBullet.
        robot: Configuration of the robot.
        rotor_scale: Multiple of the rotors' inertia; 0 means no rotors.

    Returns:
        PyBullet's index of the robot.

    Raises:
        ModelError: PyBullet changed a mass or an inertia.
    """
    wanted = link_inertias(robot, rotor_scale)
    tree = ET.parse(robot.urdf_path)
    for link in tree.getroot().findall("link"):
        _write(link, _with_moments(wanted[link.attrib["name"]], _STAND_IN))
    client.setAdditionalSearchPath(str(robot.urdf_path.parent))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / robot.urdf_path.name
        tree.write(path)
        body = int(client.loadURDF(str(path), flags=client.URDF_USE_INERTIA_FROM_FILE))
    for index in range(-1, client.getNumJoints(body)):
        name = _link_name(client, body, index)
        inertia = _about_principal_axes(client, body, index, wanted[name])
        moments = np.diag(inertia)
        left_out = float(np.abs(inertia - np.diag(moments)).max())
        if left_out > _TOLERANCE * moments.max():
            raise ModelError(name, left_out, 0.0, "product of inertia [kg m^2]")
        client.changeDynamics(body, index, localInertiaDiagonal=moments.tolist())
    _check(client, robot, body, wanted)
    return body


def moments_by_link(
    client: Any, body: int, robot: RobotConfig, rotor_scale: float
) -> list[list[float]]:
    """Compute moments of inertia about the inertial axes that the links have in PyBullet.

    If the rotor scale differs from the one with which the robot was loaded, products of inertia of
    less than 1e-3 kg m^2 are neglected.

    Args:
        client: Client of PyBullet.
        body: PyBullet's index of the loaded robot.
        robot: Configuration of the robot.
        rotor_scale: Multiple of the rotors' inertia; 0 means no rotors.

    Returns:
        Three moments [kg m^2] for each link, the base first.
    """
    wanted = link_inertias(robot, rotor_scale)
    return [
        np.diag(_about_principal_axes(
            client, body, index, wanted[_link_name(client, body, index)])).tolist()
        for index in range(-1, client.getNumJoints(body))
    ]


def _about_principal_axes(client: Any, body: int, index: int, inertia: Array) -> Array:
    axes = rotation(client.getDynamicsInfo(body, index)[4])
    return np.asarray(axes.T @ inertia @ axes)


def _check(client: Any, robot: RobotConfig, body: int, wanted: dict[str, Array]) -> None:
    """Compare inertias and mass with the wanted ones; PyBullet replaces some without a message.

    Raises:
        ModelError: An inertia or the whole mass differs.
    """
    total = 0.0
    for index in range(-1, client.getNumJoints(body)):
        name = _link_name(client, body, index)
        info = client.getDynamicsInfo(body, index)
        moments = np.linalg.eigvalsh(wanted[name])
        if not np.allclose(np.sort(info[2]), moments, rtol=1e-3, atol=1e-9):
            raise ModelError(name, info[2], moments.tolist(), "principal inertia [kg m^2]")
        total += info[0]
    if not np.isclose(total, robot.mass, rtol=1e-7):
        raise ModelError(robot.name, total, robot.mass, "mass [kg]")


def _link_name(client: Any, body: int, index: int) -> str:
    name: bytes = client.getBodyInfo(body)[0] if index < 0 else client.getJointInfo(body, index)[12]
    return name.decode()


def _with_moments(inertia: Array, moments: Array) -> Array:
    """Return an inertia (3, 3) with the principal axes of a given one and other moments (3,)."""
    axes = np.linalg.eigh(inertia)[1]
    return np.asarray(axes @ np.diag(moments) @ axes.T)


def _read(link: ET.Element) -> Array:
    element = _named(link, "inertial/inertia")
    inertia = np.zeros((3, 3))
    for name, (row, column) in _ENTRIES.items():
        inertia[row, column] = inertia[column, row] = float(element.attrib[name])
    return inertia


def _write(link: ET.Element, inertia: Array) -> None:
    element = _named(link, "inertial/inertia")
    for name, place in _ENTRIES.items():
        element.attrib[name] = repr(float(inertia[place]))


def _named(element: ET.Element, path: str) -> ET.Element:
    found = element.find(path)
    if found is None:
        what = f"element {path} of the URDF"
        raise ModelError(element.attrib["name"], "missing", "present", what)
    return found
