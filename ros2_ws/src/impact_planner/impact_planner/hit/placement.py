"""Place of the door, and the stance that reaches it, section II.C.1."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.yaml_files import read_yaml
from hrp2_description.data import package_file
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.robot_model import RobotModel

from impact_planner.hit.posture import LegDemands
from impact_planner.hit.stance import (
    HitStance,
    LeafContact,
    contact_with_leaf,
    elbow_y_at_contact,
    stance_for_contact,
    stance_for_step,
)
from impact_planner.task.request import Task
from impact_planner.task.settings import PlannerSettings, make_settings

_PASSES = 30  # limit of iterations for a door that is ajar; each one reduces the error
_CONVERGED = 1e-6  # change of elbow and hinge that ends the iterations [m]


@dataclass(frozen=True)
class Placement:
    """Place of the door in odom.

    Attributes:
        door_distance: Distance from the origin of odom to the closed leaf's face [m].
        hinge_x: x of the hinge in odom [m].
    """

    door_distance: float
    hinge_x: float

    @property
    def hinge(self) -> Array:
        """x and y of the hinge in odom, (2,) [m]."""
        return np.array([self.hinge_x, -self.door_distance])


def _place_for_step(
    robot: RobotModel, settings: PlannerSettings, step: float, initial_angle: float
) -> Placement:
    """Place a door such that the robot hits it at the nominal l_B after a step [m]."""
    elbow = stance_for_step(robot, step, settings.com_inside_edge).posture.elbow
    leaf = LeafFrame(np.zeros(2), initial_angle)
    b = elbow + robot.config.contact_radius * leaf.normal
    hinge = b - settings.nominal_l_b * leaf.along
    return Placement(door_distance=-float(hinge[1]), hinge_x=float(hinge[0]))


def stand(
    task: Task, demands: LegDemands, step: float
) -> tuple[Placement, HitStance, LeafContact]:
    """Find the place of the door, the stance and the contact for a request.

    Args:
        step: Length of the step that decides the place of the door where it is left open [m].

    Raises:
        PostureUnreachable: The door is out of the step's reach, or B is not on the leaf.
        JointLimit: The legs reach the stance but are too slow for `demands`.
    """
    robot, settings, angle, l_b = (
        task.robot, task.settings, task.wanted.initial_angle, task.wanted.l_b)
    distance, hinge_x = task.wanted.door_distance, settings.hinge_x
    if distance is None or hinge_x is None:
        nominal = _place_for_step(robot, settings, step, angle)
        distance = nominal.door_distance if distance is None else distance
        hinge_x = nominal.hinge_x if hinge_x is None else hinge_x
    elbow_x = 0.0  # first guess; it only matters for a door that is ajar
    radius, width = robot.config.contact_radius, task.known.width
    for _ in range(_PASSES):
        placement = Placement(distance, hinge_x)
        elbow_y = elbow_y_at_contact(elbow_x, radius, placement.hinge, angle)
        stance = stance_for_contact(robot, elbow_y, settings.com_inside_edge, demands)
        elbow = stance.posture.elbow
        contact = contact_with_leaf(elbow, radius, placement.hinge, angle)
        moved = abs(float(elbow[0]) - elbow_x)
        if l_b is not None:
            moved += abs(contact.l_b - l_b)
            hinge_x += (contact.l_b - l_b) / math.cos(angle)
        elbow_x = float(elbow[0])
        if moved < _CONVERGED or (angle == 0.0 and l_b is None):
            break
    if not radius < contact.l_b <= width:
        raise PostureUnreachable(
            f"B would be {contact.l_b:.3f} m from the hinge, but the elbow meets the leaf only "
            f"from {radius:.3f} m to its free edge at {width:.3f} m; change hinge_x or l_b",
            quantity="l_b [m]", value=contact.l_b, limit=(radius, width))
    height, top = float(contact.point[2]), task.known.top
    if height + radius > top:
        raise PostureUnreachable(
            f"the leaf ends {top:.3f} m above the floor, but the elbow, a ball of {radius:.3f} m, "
            f"hits it at {height:.3f} m",
            quantity="upper edge of the leaf [m]", value=top, limit=height + radius)
    return placement, stance, contact


def configured_placement(robot: RobotModel) -> Placement:
    """Return where the door stands before a robot, if nobody says more.

    For the robot that the installed bringup's parameter file was surveyed for, hrp2_description's,
    it is the place in that file, which every node of the graph reads; for others, where a nominal
    step ends.
    """
    surveyed = _surveyed() if robot.config.file is None else {}
    settings = make_settings({}, robot)
    return replace(_place_for_step(robot, settings, robot.config.step.nominal, 0.0), **surveyed)


def configured_settings(robot: RobotModel) -> PlannerSettings:
    """Return the robot's default settings with the door at its `configured_placement`."""
    return make_settings(vars(configured_placement(robot)), robot)


def bringup_parameters() -> Any:
    """Return the content of the installed bringup's parameter file; None without it.

    Raises:
        InputError: The file cannot be read.
    """
    path = package_file("package://door_impact_bringup/config/params.yaml")
    return None if path is None else read_yaml(path)


def _surveyed() -> dict[str, float]:
    try:
        common = bringup_parameters()["/**"]["ros__parameters"]
    except (KeyError, TypeError):
        return {}
    return {
        name: float(common[name])
        for name in ("door_distance", "hinge_x")
        if isinstance(common.get(name), int | float)
    }
