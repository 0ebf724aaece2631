"""Stance at the hit, section II.C.1 and Fig. 5.

The left foot stays. The right foot steps towards the door. The length of the step is chosen so that
the ground projection of the CoM is just inside the right sole's inner edge (point C of Fig. 5) when
the elbow touches the leaf.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.robot_model import RobotModel

from impact_planner.hit.posture import (
    PLAIN,
    HitPosture,
    LegDemands,
    braced,
    percussion_posture,
)

# Shares of the nominal step, tried in this order where the door's place is left open. A shorter
# step has slower knees.
STEP_SHARES = (1.0, 0.9, 0.8, 0.7)
SPARE_DISTANCE = 0.005  # travel during the contact, past the farthest planned contact [m]
# Smallest distance of the CoM inside the left sole while the right foot is in the air, as of
# HRP-2's sole [m].
SINGLE_SUPPORT_MARGIN = 0.03
DOOR_DISTANCE = "door_distance [m]"  # quantity of an error
_ELBOW_TOLERANCE = 1e-7  # largest error of the elbow's place [m]
_SLOPE = -1.08  # way of the elbow along y over that of the foot
_PASSES = 10  # limit of iterations for the length of the step


@dataclass(frozen=True)
class LeafContact:
    """Contact of the elbow with the leaf.

    Attributes:
        point: Point B, where the elbow's surface touches the face, in odom, (3,) [m].
        normal: Unit normal of the face, pointing into the door, (3,).
        l_b: Distance of B from the hinge along the leaf [m].
    """

    point: Array
    normal: Array
    l_b: float


@dataclass(frozen=True)
class HitStance:
    """Feet and posture at the hit, Fig. 5.

    Attributes:
        feet_start: Places of the soles before the step in odom by side, (3,) each [m].
        feet: Places of the soles at the hit in odom by side, (3,) each [m].
        step: Length of the right foot's step towards the door [m].
        posture: Posture of the robot at the hit.
    """

    feet_start: dict[str, Array]
    feet: dict[str, Array]
    step: float
    posture: HitPosture


def initial_base(robot: RobotModel) -> Array:
    """Compute the position of base_link in half-sitting in odom, (3,) [m].

    The origin of odom is midway between the soles then.
    """
    q = robot.configuration(np.zeros(3), robot.config.half_sitting)
    soles = [robot.frame_position(q, robot.feet[side].frame) for side in SIDES]
    return np.asarray(-0.5 * (soles[0] + soles[1]))


def initial_feet(robot: RobotModel) -> dict[str, Array]:
    """Compute the places of the soles in half-sitting by side, (3,) each [m]."""
    q = robot.configuration(initial_base(robot), robot.config.half_sitting)
    return {side: robot.frame_position(q, robot.feet[side].frame) for side in SIDES}


def sole_edges(robot: RobotModel, feet: dict[str, Array]) -> tuple[float, float]:
    """Compute the lowest and highest y of both soles together, in odom [m]."""
    corners = [robot.feet[side].corners(feet[side])[:, 1] for side in SIDES]
    return float(np.min(corners)), float(np.max(corners))


def com_x(robot: RobotModel) -> float:
    """Return x at which the CoM is kept, the middle of the soles [m]."""
    x_min, x_max = robot.feet["right"].rectangle[:2]
    return 0.5 * (x_min + x_max)


def braced_over(
    robot: RobotModel, y: Array, waist_z: float, feet: dict[str, Array], *, strict: bool = True
) -> tuple[Array, Array]:
    """Find postures of the braced robot with its CoM at `com_x` and places (N,) along y [m].

    The rest is as for `solve`.
    """
    com_xy = np.column_stack([np.full(len(y), com_x(robot)), y])
    return braced(robot, com_xy, waist_z, feet, strict=strict)


def place_feet(
    robot: RobotModel, step: float, inside_edge: float
) -> tuple[dict[str, Array], Array, Array]:
    """Place the soles at the hit by side, (3,) each, for a step of the right foot, in odom [m].

    Returns:
        The soles, and the CoM, (2,) each, at the hit and where it is farthest over the left foot.
    """
    feet = initial_feet(robot)
    feet["right"] = feet["right"] - np.array([0.0, step, 0.0])
    right_inner = float(feet["right"][1]) + robot.feet["right"].rectangle[3]
    left_inner = float(robot.feet["left"].corners(feet["left"])[:, 1].min())
    over_left = left_inner + SINGLE_SUPPORT_MARGIN * robot.config.sole_scale
    x = com_x(robot)
    return feet, np.array([x, right_inner - inside_edge]), np.array([x, over_left])


def stance_for_step(
    robot: RobotModel, step: float, inside_edge: float, demands: LegDemands = PLAIN
) -> HitStance:
    """Find the stance for a step of the right foot [m]; as for `stance_for_contact`."""
    feet, com, over_left = place_feet(robot, step, inside_edge)
    return HitStance(initial_feet(robot), feet, step,
                     percussion_posture(robot, com, feet, demands, [over_left]))


def stance_for_contact(
    robot: RobotModel, elbow_y: float, inside_edge: float, demands: LegDemands = PLAIN
) -> HitStance:
    """Find the step that brings the elbow to a place while the CoM is near the sole's inner edge.

    Args:
        elbow_y: y of the elbow's centre in odom at the hit [m].
        inside_edge: Distance of the CoM inside the right sole's inner edge at the hit [m].

    Raises:
        PostureUnreachable: The step would be outside the range of `RobotConfig.step`, or out of
            the legs' reach. The value is the door's distance, the limit the range of steps [m].
        JointLimit: The legs reach, but are too slow for the demanded speed.
    """
    allowed = robot.config.step
    step, last = allowed.nominal, None
    for _ in range(_PASSES):
        try:
            stance = stance_for_step(robot, step, inside_edge, demands)
        except PostureUnreachable:
            break
        miss = float(stance.posture.elbow[1]) - elbow_y
        if abs(miss) < _ELBOW_TOLERANCE:
            return stance
        # The elbow moves a little farther than the foot; then the secant method.
        slope = _SLOPE if last is None else (miss - last[1]) / (step - last[0])
        last, wanted = (step, miss), step - miss / slope
        step = min(max(wanted, allowed.shortest), allowed.longest)
        if step == last[0]:
            step = wanted
            break
    distance = robot.config.contact_radius - elbow_y
    raise PostureUnreachable(
        f"a door {distance:.3f} m from the origin of odom is out of reach: it needs a step of "
        f"about {step:.3f} m, and steps from {allowed.shortest:.2f} to {allowed.longest:.2f} m "
        "within the legs' reach are allowed", quantity=DOOR_DISTANCE, value=distance,
        limit=(allowed.shortest, allowed.longest))


def door_distances(robot: RobotModel, inmost: float, outmost: float) -> tuple[float, float]:
    """Compute the least and the largest distance of a closed door that the robot reaches [m].

    Both are NaN where no step is within the legs' reach.

    Args:
        inmost: Least distance of the CoM inside the right sole's inner edge [m].
        outmost: Largest such distance [m].
    """
    allowed = robot.config.step
    steps = np.arange(allowed.shortest, allowed.longest + 1e-9, 0.01).tolist()

    def first(candidates: list[float], inside_edge: float) -> float:
        for step in candidates:
            with suppress(PostureUnreachable):
                posture = stance_for_step(robot, step, inside_edge).posture
                return robot.config.contact_radius - float(posture.elbow[1])
        return math.nan

    return first(steps, inmost), first(steps[::-1], outmost)


def contact_with_leaf(elbow: Array, radius: float, hinge: Array, angle: float) -> LeafContact:
    """Compute the contact of the elbow, a sphere, with the leaf at an opening angle.

    Args:
        elbow: Centre of the sphere in odom, (3,) [m].
        radius: Radius of the sphere [m].
        hinge: x and y of the hinge in odom, which lies in the plane of the face, (2,) [m].
        angle: Opening angle of the door [rad].
    """
    leaf = LeafFrame(hinge, angle)
    point = elbow + radius * leaf.normal
    return LeafContact(point=point, normal=leaf.normal, l_b=float(leaf.radius(point)))


def elbow_y_at_contact(elbow_x: float, radius: float, hinge: Array, angle: float) -> float:
    """Compute y of the elbow's centre at which it touches the leaf [m].

    Args:
        elbow_x: x of the elbow's centre in odom [m].
        radius: Radius of the elbow's sphere [m].
        hinge: x and y of the hinge in odom, (2,) [m].
        angle: Opening angle of the door [rad].
    """
    face = float(hinge[1]) - (elbow_x - float(hinge[0])) * math.tan(angle)
    return face + radius / math.cos(angle)
