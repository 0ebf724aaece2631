"""Loads the robot's URDF into PyBullet and checks that PyBullet took its inertias as they are."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.errors import ModelError

_ENTRIES = ("ixx", "ixy", "ixz", "ixy", "iyy", "iyz", "ixz", "iyz", "izz")


def load_robot(client: Any, robot: RobotConfig) -> int:
    """Load the robot.

    Args:
        client: Client of PyBullet.
        robot: Configuration of the robot.

    Returns:
        PyBullet's index of the robot.

    Raises:
        ModelError: PyBullet changed a mass or an inertia: it replaces an inertia that violates the
            triangle inequality by zero, without a message.
    """
    client.setAdditionalSearchPath(str(robot.urdf_path.parent))
    body = int(client.loadURDF(str(robot.urdf_path), flags=client.URDF_USE_INERTIA_FROM_FILE))
    wanted = {link.attrib["name"]: _moments(link)
              for link in ET.parse(robot.urdf_path).getroot().findall("link")}
    total = 0.0
    for index in range(-1, client.getNumJoints(body)):
        name = _link_name(client, body, index)
        info = client.getDynamicsInfo(body, index)
        if not np.allclose(np.sort(info[2]), wanted[name], rtol=1e-3, atol=1e-9):
            raise ModelError(
                name, info[2], wanted[name].tolist(), "principal inertia [kg m^2]")
        total += info[0]
    if not np.isclose(total, robot.mass, rtol=1e-7):
        raise ModelError(robot.name, total, robot.mass, "mass [kg]")
    return body


def _link_name(client: Any, body: int, index: int) -> str:
    name: bytes = client.getBodyInfo(body)[0] if index < 0 else client.getJointInfo(body, index)[12]
    return name.decode()


def _moments(link: ET.Element) -> Array:
    """Return the principal moments of a link's inertia in ascending order, (3,) [kg m^2]."""
    element = link.find("inertial/inertia")
    if element is None:
        return np.zeros(3)
    entries = [float(element.attrib[name]) for name in _ENTRIES]
    return np.asarray(np.linalg.eigvalsh(np.reshape(entries, (3, 3))))
