"""Loads the robot into PyBullet: with the inertias of its URDF, and without PyBullet's defaults."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.drives_and_pads import SoleRubber
from hrp2_description.robot import SIDES, RobotConfig

from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.shapes import simulated_urdf

_ENTRIES = ("ixx", "ixy", "ixz", "ixy", "iyy", "iyz", "ixz", "iyz", "izz")
_FASTEST_JOINT = 1000.0  # limit of PyBullet's own clamp, faster than any joint [rad/s]
_CORNERS = 4  # contact points of a sole on the floor


def load_robot(client: Any, robot: RobotConfig, rubber: SoleRubber | None) -> int:
    """Load the robot with rubber or rigid soles; return PyBullet's index of it.

    Raises:
        ModelError: PyBullet changed a mass or an inertia: it replaces an inertia that violates the
            triangle inequality by zero, without a message.
    """
    path = simulated_urdf(robot)
    body = int(client.loadURDF(str(path), flags=client.URDF_USE_INERTIA_FROM_FILE))
    wanted = {link.attrib["name"]: _moments(link)
              for link in ET.parse(path).getroot().findall("link")}
    names = link_names(client, body)
    total = 0.0
    for index, name in enumerate((*names, client.getBodyInfo(body)[0].decode())):
        info = client.getDynamicsInfo(body, index if index < len(names) else -1)
        if not np.allclose(np.sort(info[2]), wanted[name], rtol=1e-3, atol=1e-9):
            raise ModelError(
                name, info[2], wanted[name].tolist(), "principal inertia [kg m^2]")
        total += info[0]
    if not np.isclose(total, robot.mass, rtol=1e-7):
        raise ModelError(robot.name, total, robot.mass, "mass [kg]")
    _override_defaults(client, body, len(names))
    for side in SIDES:
        _prepare_sole(client, body, names.index(robot.feet[side].sole), rubber)
    return body


def link_names(client: Any, body: int) -> tuple[str, ...]:
    """Return the names of the links in PyBullet's order, without the base."""
    return tuple(client.getJointInfo(body, index)[12].decode()
                 for index in range(client.getNumJoints(body)))


def _override_defaults(client: Any, body: int, joints: int) -> None:
    """Remove damping and default motors, and set the friction that suits the floor's."""
    for index in range(-1, joints):
        # One call for each setting: together with a damping or a speed, PyBullet ignores the
        # friction (github.com/bulletphysics/bullet3, issues 3314 and 4133).
        for setting in (
            {"linearDamping": 0.0, "angularDamping": 0.0},
            {"jointDamping": 0.0},
            {"maxJointVelocity": _FASTEST_JOINT},
            {"lateralFriction": 1.0, "restitution": 0.0},
        ):
            client.changeDynamics(body, index, **setting)
        if index >= 0 and client.getJointInfo(body, index)[2] != client.JOINT_FIXED:
            client.setJointMotorControl2(body, index, client.VELOCITY_CONTROL, force=0.0)


def _prepare_sole(client: Any, body: int, sole: int, rubber: SoleRubber | None) -> None:
    """Let a sole's friction hold a place, and put rubber under it.

    Without anchors the soles creep by 0.3 mm in 25 s. Stiffness and damping make each of the four
    corners an implicit spring-damper. They must be there before the first contact with the floor:
    that contact would remain rigid.
    """
    client.changeDynamics(body, sole, frictionAnchor=1)
    if rubber is not None:
        client.changeDynamics(
            body, sole,
            contactStiffness=rubber.stiffness / _CORNERS, contactDamping=rubber.damping / _CORNERS)


def _moments(link: ET.Element) -> Array:
    """Return the principal moments of a link's inertia in ascending order, (3,) [kg m^2]."""
    (element,) = link.iterfind("inertial/inertia")
    entries = [float(element.attrib[name]) for name in _ENTRIES]
    return np.asarray(np.linalg.eigvalsh(np.reshape(entries, (3, 3))))
