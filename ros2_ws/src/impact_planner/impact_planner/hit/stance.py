"""Stance at the hit, section II.C.1 and Fig. 5.

The left foot stays. The right foot steps towards the door. The length of the step is chosen so that
the ground projection of the CoM is just inside the right sole's inner edge (point C of Fig. 5) when
the elbow touches the leaf.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.robot_model import RobotModel, braced_upper_body
from humanoid_motion.whole_body import solve

from impact_planner.hit.leaf import LeafFrame
from impact_planner.hit.posture import PLAIN, HitPosture, LegDemands, percussion_posture

# Shares of the nominal step, tried in this order where the door's place is left open. A shorter
# step has slower knees.
STEP_SHARES = (1.0, 0.9, 0.8, 0.7)
SPARE_DISTANCE = 0.005  # travel during the contact, past the farthest planned contact [m]
# Smallest distance of the CoM inside the left sole while the right foot is in the air [m].
SINGLE_SUPPORT_MARGIN = 0.03
_ELBOW_TOLERANCE = 1e-7  # largest error of the elbow's place [m]
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
        percussion_error: Error of the CoM's height against eq. (5) [m]; 0 where eq. (5) is met.
    """

    feet_start: dict[str, Array]
    feet: dict[str, Array]
    step: float
    posture: HitPosture
    percussion_error: float


def initial_feet(robot: RobotModel) -> dict[str, Array]:
    """Places of the soles in half-sitting by side, (3,) each [m].

    The origin of odom is midway between them.
    """
    q = robot.configuration(np.zeros(3), robot.config.half_sitting)
    soles = {side: robot.frame_position(q, robot.feet[side].frame) for side in SIDES}
    middle = 0.5 * (soles["left"] + soles["right"])
    return {side: soles[side] - middle for side in SIDES}


def initial_base(robot: RobotModel) -> Array:
    """Position of base_link in half-sitting in odom, (3,) [m]."""
    q = robot.configuration(np.zeros(3), robot.config.half_sitting)
    soles = [robot.frame_position(q, robot.feet[side].frame) for side in SIDES]
    return np.asarray(-0.5 * (soles[0] + soles[1]))


def sole_edges(robot: RobotModel, feet: dict[str, Array]) -> tuple[float, float]:
    """Lowest and highest y of both soles together, in odom [m]."""
    corners = [robot.feet[side].corners(feet[side])[:, 1] for side in SIDES]
    return float(np.min(corners)), float(np.max(corners))


def com_x(robot: RobotModel) -> float:
    """x at which the CoM is kept, the middle of the soles [m]."""
    x_min, x_max = robot.feet["right"].rectangle[:2]
    return 0.5 * (x_min + x_max)


def braced_over(
    robot: RobotModel, y: Array, waist_z: float, feet: dict[str, Array], *, strict: bool = True
) -> tuple[Array, Array]:
    """Postures of the braced robot with its CoM at `com_x` and given places along y.

    Args:
        robot: The robot.
        y: Places of the CoM along y in odom, (N,) [m].
        waist_z: Height of base_link above the floor [m].
        feet: Places of the soles in odom by side, (3,) each [m].
        strict: Whether an unreachable posture is an error; if not, its row is NaN.

    Returns:
        Joints (N, J) [rad] and base (N, 3) [m].

    Raises:
        PostureUnreachable: With `strict`, a leg does not reach.
    """
    return solve(
        robot,
        upper=braced_upper_body(robot),
        com_xy=np.column_stack([np.full(len(y), com_x(robot)), y]),
        waist_z=waist_z,
        feet=feet,
        strict=strict,
    )


def com_at_hit(robot: RobotModel, right_foot: Array, inside_edge: float) -> Array:
    """Place of the CoM over the floor at the hit in odom, (2,) [m].

    Args:
        robot: The robot.
        right_foot: Place of the right sole at the hit, (3,) [m].
        inside_edge: Distance of the CoM inside the right sole's inner edge [m].
    """
    inner = right_foot[1] + robot.feet["right"].rectangle[3]
    return np.array([com_x(robot), inner - inside_edge])


def stance_for_step(
    robot: RobotModel, step: float, inside_edge: float, demands: LegDemands = PLAIN
) -> HitStance:
    """Find the stance for a given step; arguments and errors as for `stance_for_contact`.

    Args:
        robot: The robot.
        step: Length of the right foot's step [m].
        inside_edge: Distance of the CoM inside the right sole's inner edge at the hit [m].
        demands: Demands on the legs past the hit.
    """
    start = initial_feet(robot)
    feet = _stepped(start, step)
    com = com_at_hit(robot, feet["right"], inside_edge)
    inner_edge = float(robot.feet["left"].corners(feet["left"])[:, 1].min())
    over_left = np.array([com[0], inner_edge + SINGLE_SUPPORT_MARGIN])
    posture, error = percussion_posture(robot, com, feet, demands, [over_left])
    return HitStance(start, feet, step, posture, error)


def stance_for_contact(
    robot: RobotModel, elbow_y: float, inside_edge: float, demands: LegDemands = PLAIN
) -> HitStance:
    """Find the step that brings the elbow to a place while the CoM is near the sole's inner edge.

    Args:
        robot: The robot.
        elbow_y: y of the elbow's centre in odom at the hit [m].
        inside_edge: Distance of the CoM inside the right sole's inner edge at the hit [m].
        demands: Demands on the legs past the hit.

    Raises:
        PostureUnreachable: The step would be outside the range of `RobotConfig.step`, or out of
            the legs' reach. Value and limit are the door's distance and its range [m].
        JointLimit: The legs reach, but are too slow for the demanded speed.
    """
    allowed = robot.config.step
    step, last = allowed.nominal, None
    for _ in range(_PASSES):
        try:
            stance = stance_for_step(robot, step, inside_edge, demands)
        except PostureUnreachable:
            raise _out_of_reach(robot, elbow_y, step, inside_edge) from None
        miss = float(stance.posture.elbow[1]) - elbow_y
        if abs(miss) < _ELBOW_TOLERANCE:
            return stance
        # The first slope assumes that the elbow moves with the foot; then the secant method.
        slope = -1.0 if last is None else (miss - last[1]) / (step - last[0])
        last = step, miss
        step -= miss / slope
        if not allowed.shortest <= step <= allowed.longest:
            raise _out_of_reach(robot, elbow_y, step, inside_edge)
    raise _out_of_reach(robot, elbow_y, step, inside_edge)


def elbow_range(robot: RobotModel, inside_edge: float) -> tuple[float, float]:
    """Farthest and nearest y of the elbow that a step within its limits reaches [m].

    Both are NaN where no step is within the legs' reach.
    """
    reach, allowed = [], robot.config.step
    for step in np.arange(allowed.shortest, allowed.longest + 1e-9, 0.01):
        try:
            stance = stance_for_step(robot, float(step), inside_edge)
        except PostureUnreachable:
            continue
        reach.append(float(stance.posture.elbow[1]))
    return (min(reach), max(reach)) if reach else (math.nan, math.nan)


def _stepped(start: dict[str, Array], step: float) -> dict[str, Array]:
    """Places of the soles after the right foot's step of a given length [m]."""
    return {"left": start["left"], "right": start["right"] - np.array([0.0, step, 0.0])}


def _out_of_reach(
    robot: RobotModel, elbow_y: float, step: float, inside_edge: float
) -> PostureUnreachable:
    """The error of a door that no allowed step reaches; lengths as for `stance_for_contact`."""
    far, near = elbow_range(robot, inside_edge)
    radius, allowed = robot.config.contact_radius, robot.config.step
    return PostureUnreachable(
        f"a door {radius - elbow_y:.3f} m from the origin of odom is out of reach: it needs a step "
        f"of about {step:.3f} m, and steps from {allowed.shortest:.2f} to {allowed.longest:.2f} m "
        f"are allowed; a closed door must stand {radius - near:.3f} to {radius - far:.3f} m from "
        "the origin",
        quantity="door_distance [m]",
        value=radius - elbow_y,
        limit=(radius - near, radius - far),
    )


def contact_with_leaf(elbow: Array, radius: float, hinge: Array, angle: float) -> LeafContact:
    """Contact of the elbow, a sphere, with the leaf at an opening angle.

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
    """y of the elbow's centre at which it touches the leaf [m].

    Args:
        elbow_x: x of the elbow's centre in odom [m].
        radius: Radius of the elbow's sphere [m].
        hinge: x and y of the hinge in odom, (2,) [m].
        angle: Opening angle of the door [rad].
    """
    face = float(hinge[1]) - (elbow_x - float(hinge[0])) * math.tan(angle)
    return face + radius / math.cos(angle)
