"""Where the robot stands at the hit, section II.C.1.

The left foot stays. The right foot steps towards the door, so far that the ground projection of
the CoM is just inside its inner edge (point C of Fig. 5) when the elbow touches the leaf.
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

# Of the nominal step, tried in this order where the door's place is left open: the shorter the
# step, the slower the knees.
STEP_SHARES = (1.0, 0.9, 0.8, 0.7)
SPARE_WAY = 0.005  # past the last contact that is planned for: the contact itself [m]
# The CoM stays at least so far inside the left sole while the right foot is in the air [m].
SINGLE_SUPPORT_MARGIN = 0.03
_ELBOW_TOLERANCE = 1e-7  # [m]
_PASSES = 10


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


def sole_edges(robot: RobotModel, feet: dict[str, Array]) -> tuple[float, float]:
    """Lower and upper y of both soles [m]."""
    corners = [robot.feet[side].corners(feet[side])[:, 1] for side in SIDES]
    return float(np.min(corners)), float(np.max(corners))


def com_x(robot: RobotModel) -> float:
    """Where the CoM is kept along x: over the middle of the soles [m]."""
    x_min, x_max = robot.feet["right"].rectangle[:2]
    return 0.5 * (x_min + x_max)


def braced_over(
    robot: RobotModel, y: Array, waist_z: float, feet: dict[str, Array], *, strict: bool = True
) -> tuple[Array, Array]:
    """The braced robot with its CoM at `com_x` and places along y, (N,) [m]; see `solve`."""
    return solve(
        robot,
        upper=braced_upper_body(robot),
        com_xy=np.column_stack([np.full(len(y), com_x(robot)), y]),
        waist_z=waist_z,
        feet=feet,
        strict=strict,
    )


def com_at_hit(robot: RobotModel, right_foot: Array, inside_edge: float) -> Array:
    """CoM over the floor at the hit: so far inside the right sole's inner edge, (2,) [m]."""
    inner = right_foot[1] + robot.feet["right"].rectangle[3]
    return np.array([com_x(robot), inner - inside_edge])


def stance_for_step(
    robot: RobotModel, step: float, inside_edge: float, demands: LegDemands = PLAIN
) -> Stance:
    """Stance and posture for a given length of the step [m]; see `stance_for_contact`."""
    start = initial_feet(robot)
    feet = _stepped(start, step)
    com = com_at_hit(robot, feet["right"], inside_edge)
    inner_edge = float(robot.feet["left"].corners(feet["left"])[:, 1].min())
    over_left = np.array([com[0], inner_edge + SINGLE_SUPPORT_MARGIN])
    posture, error = percussion_posture(robot, com, feet, demands, [over_left])
    return Stance(start, feet, step, posture, error)


def stance_for_contact(
    robot: RobotModel, elbow_y: float, inside_edge: float, demands: LegDemands = PLAIN
) -> Stance:
    """The step that brings the elbow to a place while the CoM is over its edge.

    Args:
        robot: The robot.
        elbow_y: y of the elbow's centre in odom at the hit [m].
        inside_edge: How far the CoM is inside the right sole's inner edge at the hit [m].
        demands: What the legs must do past the hit.

    Raises:
        PostureUnreachable: The step would be shorter or longer than `RobotConfig.step` says, or
            out of the legs' reach; the limit is the range of elbow_y that can be reached [m].
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
        # The elbow goes with the foot almost one to one; then by the secant.
        slope = -1.0 if last is None else (miss - last[1]) / (step - last[0])
        last = step, miss
        step -= miss / slope
        if not allowed.shortest <= step <= allowed.longest:
            raise _out_of_reach(robot, elbow_y, step, inside_edge)
    raise _out_of_reach(robot, elbow_y, step, inside_edge)


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
    leaf = LeafFrame(hinge, angle)
    point = elbow + radius * leaf.normal
    return Contact(point=point, normal=leaf.normal, l_b=float(leaf.radius(point)))


def elbow_y_at_contact(elbow_x: float, radius: float, hinge: Array, angle: float) -> float:
    """y of the elbow's centre when it touches the leaf [m]; see `contact_with_leaf`."""
    face = float(hinge[1]) - (elbow_x - float(hinge[0])) * math.tan(angle)
    return face + radius / math.cos(angle)
