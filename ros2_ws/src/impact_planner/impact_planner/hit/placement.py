"""Where the door is, where the feet go, and where the elbow meets the leaf."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import InvalidRequest
from impact_planner.hit.leaf import LeafFrame
from impact_planner.hit.posture import LegDemands
from impact_planner.hit.stance import (
    Contact,
    Stance,
    contact_with_leaf,
    elbow_y_at_contact,
    stance_for_contact,
    stance_for_step,
)
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import ResolvedRequest
from impact_planner.task.settings import PlannerSettings

_PASSES = 30  # of where the elbow meets a door that is ajar; each leaves a part of the error


@dataclass(frozen=True)
class Placement:
    """Where the door is.

    Attributes:
        door_distance: From the origin of odom to the closed leaf's face [m].
        hinge_x: x of the hinge [m].
    """

    door_distance: float
    hinge_x: float

    @property
    def hinge(self) -> Array:
        """x and y of the hinge in odom, (2,) [m]."""
        return np.array([self.hinge_x, -self.door_distance])


def placement_for_step(
    robot: RobotModel, settings: PlannerSettings, step: float, initial_angle: float = 0.0
) -> Placement:
    """Where a door stands that a step of a length [m] and the nominal l_B reach.

    Args:
        robot: The robot.
        settings: Configuration.
        step: Of the right foot towards the door [m].
        initial_angle: Of the door at the hit [rad].

    Raises:
        PostureUnreachable: The legs do not reach.
    """
    elbow = stance_for_step(robot, step, settings.com_inside_edge).posture.elbow
    leaf = LeafFrame(np.zeros(2), initial_angle)
    b = elbow + robot.config.contact_radius * leaf.normal
    hinge = b - settings.nominal_l_b * leaf.along
    return Placement(door_distance=-float(hinge[1]), hinge_x=float(hinge[0]))


def stand(
    robot: RobotModel,
    known: KnownDoor,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    demands: LegDemands,
    step: float,
) -> tuple[Placement, Stance, Contact]:
    """Find the placement of the door, the stance and the contact of a request.

    Args:
        robot: The robot.
        known: The door.
        wanted: The request.
        settings: Configuration.
        demands: What the legs must do past the hit.
        step: With which a door is reached whose place is left open [m].

    Raises:
        PostureUnreachable: The door is out of the step's reach, or B off the leaf.
    """
    distance, hinge_x = wanted.door_distance, settings.hinge_x
    if distance is None or hinge_x is None:
        nominal = placement_for_step(robot, settings, step, wanted.initial_angle)
        distance = nominal.door_distance if distance is None else distance
        hinge_x = nominal.hinge_x if hinge_x is None else hinge_x
    if not math.isfinite(hinge_x):
        raise InvalidRequest(
            f"hinge_x [m] must be a number, not {hinge_x}", quantity="hinge_x [m]", value=hinge_x
        )
    elbow_x = 0.0  # a first guess; it only matters for a door that is ajar
    radius = robot.config.contact_radius
    for _ in range(_PASSES):
        placement = Placement(distance, hinge_x)
        elbow_y = elbow_y_at_contact(elbow_x, radius, placement.hinge, wanted.initial_angle)
        stance = stance_for_contact(robot, elbow_y, settings.com_inside_edge, demands)
        elbow = stance.posture.elbow
        contact = contact_with_leaf(elbow, radius, placement.hinge, wanted.initial_angle)
        moved = abs(float(elbow[0]) - elbow_x)
        if wanted.l_b is not None:
            moved += abs(contact.l_b - wanted.l_b)
            hinge_x += (contact.l_b - wanted.l_b) / math.cos(wanted.initial_angle)
        elbow_x = float(elbow[0])
        if moved < 1e-6 or (wanted.initial_angle == 0.0 and wanted.l_b is None):
            break
    if not radius < contact.l_b <= known.width:
        raise PostureUnreachable(
            f"B would be {contact.l_b:.3f} m from the hinge; the elbow meets the leaf from "
            f"{radius:.3f} m to its free edge at {known.width:.3f} m",
            quantity="l_b [m]",
            value=contact.l_b,
            limit=(radius, known.width),
        )
    return placement, stance, contact
