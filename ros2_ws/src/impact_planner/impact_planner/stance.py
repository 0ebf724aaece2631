"""Where the robot stands at the hit, section II.C.1.

The left foot stays. The right foot steps towards the door, so far that the ground projection of
the CoM is just inside its inner edge (point C of Fig. 5) when the elbow touches the leaf.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from .errors import PostureUnreachable
from .posture import HitPosture, percussion_posture, posture_at
from .robot_model import SIDES, RobotModel

Array = NDArray[np.float64]

SHORTEST_OVERRUN = 0.02  # of the run-up past the nominal contact [m]
# The CoM stays at least so far inside the left sole while the right foot is in the air [m].
SINGLE_SUPPORT_MARGIN = 0.03
_HEIGHT_TOLERANCE = 1e-5  # [m]


@dataclass(frozen=True)
class Contact:
    """How the leaf and the elbow meet.

    Attributes:
        point: B, where the elbow's surface touches the face, in odom, (3,) [m].
        normal: Of the face, into the door, (3,).
        l_b: Distance of B from the hinge along the leaf [m].
    """

    point: Array
    normal: Array
    l_b: float


@dataclass(frozen=True)
class Stance:
    """Feet and posture at the hit.

    Attributes:
        feet_start: Soles before the step, by side, (3,) each [m].
        feet: Soles at the hit.
        step: Length of the right foot's step towards the door [m].
        posture: The robot at the hit.
        percussion_error: How far eq. (5) is missed [m]; 0 where it is met.
    """

    feet_start: dict[str, Array]
    feet: dict[str, Array]
    step: float
    posture: HitPosture
    percussion_error: float


def initial_feet(robot: RobotModel) -> dict[str, Array]:
    """Soles of half-sitting, with the origin of odom midway between them, (3,) each [m]."""
    q = robot.configuration(np.zeros(3), robot.config.half_sitting)
    soles = {side: robot.frame_position(q, robot.feet[side].frame) for side in SIDES}
    middle = 0.5 * (soles["left"] + soles["right"])
    return {side: soles[side] - middle for side in SIDES}


def initial_base(robot: RobotModel) -> Array:
    """base_link of half-sitting in odom, (3,) [m]."""
    q = robot.configuration(np.zeros(3), robot.config.half_sitting)
    soles = [robot.frame_position(q, robot.feet[side].frame) for side in SIDES]
    return np.asarray(-0.5 * (soles[0] + soles[1]))


def com_x(robot: RobotModel) -> float:
    """Where the CoM is kept along x: over the middle of the soles [m]."""
    x_min, x_max = robot.feet["right"].rectangle[:2]
    return 0.5 * (x_min + x_max)


def com_at_hit(robot: RobotModel, right_foot: Array, inside_edge: float) -> Array:
    """CoM over the floor at the hit: so far inside the right sole's inner edge, (2,) [m]."""
    inner = right_foot[1] + robot.feet["right"].rectangle[3]
    return np.array([com_x(robot), inner - inside_edge])


def stance_for_step(robot: RobotModel, step: float, inside_edge: float) -> Stance:
    """Stance and posture for a given length of the step [m]."""
    start = initial_feet(robot)
    feet = _stepped(start, step)
    com = com_at_hit(robot, feet["right"], inside_edge)
    inner_edge = float(robot.feet["left"].corners(feet["left"])[:, 1].min())
    passed = [
        com - np.array([0.0, SHORTEST_OVERRUN]),
        np.array([com[0], inner_edge + SINGLE_SUPPORT_MARGIN]),
    ]
    posture, error = percussion_posture(robot, com, feet, passed)
    return Stance(start, feet, step, posture, error)


def stance_for_contact(robot: RobotModel, elbow_y: float, inside_edge: float) -> Stance:
    """The step that brings the elbow to a place while the CoM is over its edge.

    Args:
        robot: The robot.
        elbow_y: y of the elbow's centre in odom at the hit [m].
        inside_edge: How far the CoM is inside the right sole's inner edge at the hit [m].

    Raises:
        PostureUnreachable: The step would be shorter or longer than `RobotConfig.step` says, or
            out of the legs' reach; the limit is the range of elbow_y that can be reached [m].
    """
    start, allowed = initial_feet(robot), robot.config.step
    stance = stance_for_step(robot, allowed.nominal, inside_edge)
    for _ in range(8):
        height = stance.posture.waist_height
        error = stance.posture.elbow[1] - elbow_y
        # The elbow goes with the foot almost one to one; brentq does the rest.
        guess = stance.step + error
        if not allowed.shortest - 0.05 < guess < allowed.longest + 0.05:
            raise _out_of_reach(robot, elbow_y, guess, inside_edge)

        def miss(step: float, height: float = height) -> float:
            feet = _stepped(start, step)
            com = com_at_hit(robot, feet["right"], inside_edge)
            return float(posture_at(robot, height, com, feet).elbow[1]) - elbow_y

        try:
            step = float(brentq(miss, guess - 0.02, guess + 0.02, xtol=1e-9))
        except (ValueError, PostureUnreachable):
            raise _out_of_reach(robot, elbow_y, guess, inside_edge) from None
        if not allowed.shortest <= step <= allowed.longest:
            raise _out_of_reach(robot, elbow_y, step, inside_edge)
        try:
            stance = stance_for_step(robot, step, inside_edge)
        except PostureUnreachable:
            raise _out_of_reach(robot, elbow_y, step, inside_edge) from None
        if abs(stance.posture.waist_height - height) < _HEIGHT_TOLERANCE:
            break
    return stance


def elbow_range(robot: RobotModel, inside_edge: float) -> tuple[float, float]:
    """Furthest and nearest y of the elbow that a step within its limits reaches [m]."""
    reach, allowed = [], robot.config.step
    for step in np.arange(allowed.shortest, allowed.longest + 1e-9, 0.01):
        try:
            stance = stance_for_step(robot, float(step), inside_edge)
        except PostureUnreachable:
            continue
        reach.append(float(stance.posture.elbow[1]))
    return (min(reach), max(reach)) if reach else (math.nan, math.nan)


def _stepped(start: dict[str, Array], step: float) -> dict[str, Array]:
    return {"left": start["left"], "right": start["right"] - np.array([0.0, step, 0.0])}


def _out_of_reach(
    robot: RobotModel, elbow_y: float, step: float, inside_edge: float
) -> PostureUnreachable:
    far, near = elbow_range(robot, inside_edge)
    radius, allowed = robot.config.contact_radius, robot.config.step
    return PostureUnreachable(
        f"a door {radius - elbow_y:.3f} m from the origin is out of reach: the elbow would have to "
        f"be at y = {elbow_y:.3f} m, which needs a step of about "
        f"{step:.3f} m; steps from {allowed.shortest:.2f} to {allowed.longest:.2f} m put it at "
        f"{near:.3f} to {far:.3f} m: a closed door must stand {radius - near:.3f} to "
        f"{radius - far:.3f} m from the origin",
        quantity="door_distance [m]",
        value=radius - elbow_y,
        limit=(radius - near, radius - far),
    )


def contact_with_leaf(elbow: Array, radius: float, hinge: Array, angle: float) -> Contact:
    """Where a sphere touches the leaf that stands at an angle.

    Args:
        elbow: Centre of the sphere, (3,) [m].
        radius: Its radius [m].
        hinge: x and y of the hinge, which lies in the plane of the face, (2,) [m].
        angle: Opening angle of the door [rad].
    """
    along = np.array([math.cos(angle), -math.sin(angle)])
    normal = np.array([-math.sin(angle), -math.cos(angle), 0.0])
    point = elbow + radius * normal
    return Contact(point=point, normal=normal, l_b=float(along @ (point[:2] - hinge)))


def elbow_y_at_contact(elbow_x: float, radius: float, hinge: Array, angle: float) -> float:
    """y of the elbow's centre when it touches the leaf [m]; see `contact_with_leaf`."""
    face = float(hinge[1]) - (elbow_x - float(hinge[0])) * math.tan(angle)
    return face + radius / math.cos(angle)
