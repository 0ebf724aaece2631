"""Posture at the hit, section II.C.4: the waist height that meets eq. (5).

Eq. (5) puts the center of percussion on the floor at point C of Fig. 5, so that the feet do not
slip in the hit.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.robot_model import RobotModel, braced_upper_body
from humanoid_motion.whole_body import solve, within_ranges
from scipy.optimize import brentq

from impact_planner.hit import momentum

_STEP = 0.02  # step between candidate heights of the waist [m]
# Distance from the joints' limits [rad]: a lifted foot needs more hip roll than one on the floor,
# and servos are not exact.
RESERVE = 0.015
_REFINEMENTS = 2  # number of times that the step is refined where the legs' reach ends
_FINER = 20  # factor by which each refinement divides the step
_DIFFERENCE = 1e-3  # distance of the CoM's places in finite differences [m]


@dataclass(frozen=True)
class LegDemands:
    """Demands on the legs beyond standing at the hit.

    Attributes:
        beyond: Distance past the hit that the CoM must be able to travel [m].
        speed: Speed of the CoM at the end of that distance [m/s].
        joint_speed: Largest allowed speeds of the joints there, (J,) [rad/s]. A nearly stretched
            leg has a fast knee. None means that any speed is allowed.
    """

    beyond: float = 0.02
    speed: float = 0.0
    joint_speed: Array | None = None


PLAIN = LegDemands()


@dataclass(frozen=True)
class HitPosture:
    """Posture of the robot at the hit, with the quantities of eqs. (3) and (5).

    Attributes:
        waist_height: Height of base_link above the floor [m].
        joints: Angles of the joints, (J,) [rad].
        base: Position of base_link in odom, (3,) [m].
        com: Position of the CoM in odom, (3,) [m].
        elbow: Centre of the contact body at the elbow in odom, (3,) [m].
        a_r: Height of B above the CoM [m].
        b_r: Height of the CoM above the floor [m].
        i_rob: Moment of inertia about the x axis through the CoM [kg m^2].
        b_r_percussion: Height of the CoM that eq. (5) demands [m]; infinite for a_r <= 0.
    """

    waist_height: float
    joints: Array
    base: Array
    com: Array
    elbow: Array
    a_r: float
    b_r: float
    i_rob: float
    b_r_percussion: float

    @property
    def percussion_error(self) -> float:
        """Height of the CoM above the height that eq. (5) demands [m]."""
        return self.b_r - self.b_r_percussion


def braced(
    robot: RobotModel, com_xy: Array, waist_z: float | Array, feet: dict[str, Array],
    *, strict: bool = True,
) -> tuple[Array, Array]:
    """Find joints (N, J) [rad] and base (N, 3) [m] of the braced robot; as for `solve`."""
    return solve(robot, upper=braced_upper_body(robot), com_xy=com_xy, waist_z=waist_z, feet=feet,
                 strict=strict)


def _posture_at(
    robot: RobotModel, waist_height: float, com_xy: Array, feet: dict[str, Array]
) -> HitPosture:
    """Find the braced robot's posture for a height of the waist [m] and a place of the CoM."""
    joints, base = braced(robot, com_xy, waist_height, feet)
    return _figures(robot, waist_height, joints[0], base[0])


def _figures(robot: RobotModel, waist_height: float, joints: Array, base: Array) -> HitPosture:
    """Compute the quantities of eqs. (3) and (5) for joints (J,) [rad] and base (3,) [m]."""
    q = robot.configuration(base, joints)
    com, elbow = robot.com(q), robot.contact_position(q)
    i_rob = float(robot.inertia_about_com(q)[0, 0])
    a_r = float(elbow[2] - com[2])
    percussion = momentum.percussion_height(robot.mass, i_rob, a_r) if a_r > 0.0 else np.inf
    return HitPosture(waist_height, joints, base, com, elbow, a_r, float(com[2]), i_rob,
                      float(percussion))


def percussion_posture(
    robot: RobotModel,
    com_xy: Array,
    feet: dict[str, Array],
    demands: LegDemands = PLAIN,
    also: Sequence[Array] = (),
) -> HitPosture:
    """Find the posture whose center of percussion lies on the floor, eq. (5).

    Where no height within the legs' reach meets eq. (5), it is the posture that comes nearest.

    Args:
        com_xy: Place of the CoM over the floor at the hit in odom, (2,) [m].
        feet: Places of the soles at the hit in odom by side, (3,) each [m].
        also: Other places of the CoM that the motion passes at the same height of the waist and
            the legs must reach with `RESERVE`, (2,) each [m].

    Raises:
        PostureUnreachable: The legs reach no height of the waist.
        JointLimit: The legs reach, but are too slow for the demanded speed.
    """
    lowest, highest = robot.waist_heights()
    for step in (_STEP, _STEP / _FINER):  # the finer step finds a narrow range of heights
        heights: Array = np.arange(lowest, highest + 1e-9, step)
        excess, joints, base = at_heights(robot, heights, com_xy, feet, demands, also)
        within = np.flatnonzero(excess.max(axis=1) <= 0.0)
        if within.size:
            break
    else:
        raise incapable(robot, excess, feet, demands)
    ends = _bracket([_figures(robot, float(heights[i]), joints[i], base[i]) for i in within])
    if ends[0].percussion_error * ends[1].percussion_error > 0.0:
        near = int(abs(ends[1].percussion_error) < abs(ends[0].percussion_error))
        step = (-step, step)[near]
        last = ends[near].waist_height
        for _ in range(_REFINEMENTS):  # approaches eq. (5) as closely as the legs allow
            step /= _FINER
            finer: Array = last + step * np.arange(1.0, _FINER)
            excess, _, _ = at_heights(robot, finer, com_xy, feet, demands, also)
            last += step * float(np.argmin(np.append(excess.max(axis=1) <= 0.0, False)))
        ends[near] = _posture_at(robot, last, com_xy, feet)
    if ends[0].percussion_error * ends[1].percussion_error > 0.0:
        return min(ends, key=lambda posture: abs(posture.percussion_error))
    height = brentq(
        lambda z: _posture_at(robot, z, com_xy, feet).percussion_error,
        ends[0].waist_height, ends[1].waist_height, xtol=1e-6)
    return _posture_at(robot, float(height), com_xy, feet)


def _bracket(postures: list[HitPosture]) -> list[HitPosture]:
    """Return neighbouring postures between which eq. (5) is met; else the first and the last."""
    for lower, upper in itertools.pairwise(postures):
        if lower.percussion_error * upper.percussion_error <= 0.0:
            return [lower, upper]
    return [postures[0], postures[-1]]


def waist_per_com(robot: RobotModel, posture: HitPosture, feet: dict[str, Array]) -> float:
    """Compute the speed of waist and point B towards the door over that of the CoM."""
    half = np.array([0.0, 0.5 * _DIFFERENCE])
    _, base = braced(robot, np.array([posture.com[:2] - half, posture.com[:2] + half]),
                     posture.waist_height, feet)
    return float(base[1, 1] - base[0, 1]) / _DIFFERENCE


def capable(
    robot: RobotModel, posture: HitPosture, feet: dict[str, Array], demands: LegDemands
) -> bool:
    """Whether the legs meet the demands past a posture."""
    height = np.array([posture.waist_height])
    excess, _, _ = at_heights(robot, height, posture.com[:2], feet, demands, ())
    return bool((excess <= 0.0).all())


def at_heights(
    robot: RobotModel,
    heights: Array,
    com_xy: Array,
    feet: dict[str, Array],
    demands: LegDemands,
    also: Sequence[Array],
) -> tuple[Array, Array, Array]:
    """Check the demands on the legs at several heights of the waist, (H,) [m].

    Returns:
        Excess of each joint's speed over its limit as a share of the limit, (H, J), which is
        infinite where a leg does not reach; joints (H, J) [rad] and base (H, 3) [m] with the CoM
        at `com_xy`.
    """
    end = com_xy - np.array([0.0, demands.beyond])
    half = np.array([0.0, 0.5 * _DIFFERENCE])
    places = np.array([end - half, end + half, com_xy, *also], dtype=float)
    joints, base = braced(
        robot, np.tile(places, (len(heights), 1)), np.repeat(heights, len(places)), feet,
        strict=False)
    joints, base = (rows.reshape(len(heights), len(places), -1) for rows in (joints, base))
    excess = np.full((len(heights), joints.shape[2]), -1.0)
    if demands.joint_speed is not None:
        slope = np.abs(joints[:, 1] - joints[:, 0]) / _DIFFERENCE
        excess = slope * demands.speed / demands.joint_speed - 1.0
    reserve = np.where(np.arange(len(places)) < 3, 0.0, RESERVE)[:, None]
    inside = np.all(within_ranges(robot, joints, reserve), axis=(1, 2))
    return np.where(inside[:, None], excess, np.inf), joints[:, 2], base[:, 2]


def incapable(
    robot: RobotModel, excess: Array, feet: dict[str, Array], demands: LegDemands
) -> DoorImpactError:
    """Make the error of a stance that no height of the waist allows: out of reach or too slow."""
    if demands.joint_speed is None or not np.isfinite(excess).any():
        right, (lowest, highest) = float(feet["right"][1]), robot.waist_heights()
        return PostureUnreachable(
            f"no waist height from {lowest:.2f} to {highest:.2f} m keeps the legs within their "
            f"ranges with the right foot at y = {right:.3f} m; a nearer door needs a shorter step",
            quantity="y of the right foot [m]", value=right, limit=(lowest, highest))
    best = int(np.argmin(excess.max(axis=1)))
    joint = int(np.argmax(excess[best]))
    name, limit = robot.joint_names[joint], float(demands.joint_speed[joint])
    value = (1.0 + float(excess[best, joint])) * limit
    return JointLimit(
        f"cam: {name} would turn at {value:.2f} rad/s or more {1e3 * demands.beyond:.0f} mm past "
        f"the nominal contact at every height of the waist, {limit:.2f} rad/s are allowed; request "
        "a smaller angle or a shorter step",
        joint=name, phase="cam", quantity="speed [rad/s]", value=value, limit=limit)
