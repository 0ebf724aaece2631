"""Checks of a walk against the limits of joints, floor and bodies."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.clearance import Clearance, bodies_of, require_clearance
from humanoid_motion.dynamics import Dynamics, joint_torques
from humanoid_motion.motion import BaseYaw, Motion
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import require_joint_limits, require_torque_limits, shares
from humanoid_motion.zmp import margins

from walking.errors import WalkInfeasible
from walking.pattern.settings import WalkSettings
from walking.pattern.timing import Phase, Schedule
from walking.pattern.walk_plan import WalkChecks

FRICTION = "friction"
"""Quantity of the error of soles that would slip."""
_NAME = "walk"
_STILL = 1e-3  # speed below which a joint counts as at rest [rad/s]


def check_walk(
    robot: RobotModel,
    motion: Motion,
    dynamics: Dynamics,
    plan: Schedule,
    settings: WalkSettings,
    *,
    clearance: bool = True,
) -> WalkChecks:
    """Check a walk at its samples.

    Args:
        dynamics: Its inverse dynamics.
        plan: Its phases.
        settings: Limits.
        clearance: Whether the distances between the robot's bodies are checked, which takes as
            long as everything else together.

    Raises:
        JointLimit: Position, speed or torque of a joint exceeds its limit.
        WalkInfeasible: The ZMP comes too near to the edge of the soles, or the soles would slip.
        PostureUnreachable: Two bodies of the robot come too near to each other.
    """
    require_joint_limits(robot, motion, _NAME, share=settings.speed_share)
    margin = zmp_margins(robot, dynamics.zmp, plan)
    torque = np.zeros_like(motion.joints)
    for phase in plan.phases:
        rows = slice(phase.first, phase.last + 1)
        feet, yaw = soles_of(phase)
        found = joint_torques(
            robot, _part(motion, rows), _part_dynamics(dynamics, rows), feet, phase.sides, yaw)
        torque[rows] = np.where(np.abs(found) > np.abs(torque[rows]), found, torque[rows])
    _require_margin(margin, motion.time, settings.required_margin)
    _require_rest(robot, motion)
    friction = needed_friction(robot, dynamics)
    require_friction(friction, motion.time, settings.friction)
    require_torque_limits(robot, torque, _NAME, share=settings.torque_share)
    nearest: Clearance | None = None
    if clearance:
        nearest = bodies_of(robot).self_clearance(motion, robot.config.clearance)
        require_clearance(nearest, _NAME)
    return WalkChecks(
        margin=margin,
        speed_ratio=shares(motion.joint_speed, robot.speed_limit).max(axis=0),
        torque_ratio=shares(torque, robot.effort_limit).max(axis=0),
        friction=friction,
        clearance=nearest,
    )


def soles_of(phase: Phase) -> tuple[dict[str, Array], dict[str, float]]:
    """Return places (3,) [m] and headings [rad] in odom, by side, of the soles that bear load."""
    poses = {side: phase.stance.foot(side) for side in phase.sides}
    return ({side: np.array([pose.x, pose.y, 0.0]) for side, pose in poses.items()},
            {side: pose.yaw for side, pose in poses.items()})


def zmp_margins(robot: RobotModel, zmp: Array, plan: Schedule) -> Array:
    """Compute the distance of the ZMP (N, 2) [m] from the edge of the soles, (N,) [m]."""
    margin = np.full(len(zmp), np.inf)
    for phase in plan.phases:
        rows = slice(phase.first, phase.last + 1)
        feet, yaw = soles_of(phase)
        margin[rows] = np.minimum(
            margin[rows], margins(robot, zmp[rows], feet, phase.sides, yaw))
    return margin


def needed_friction(robot: RobotModel, dynamics: Dynamics) -> Array:
    """Compute the coefficient of friction that one sole would need for force and yaw moment, (N,).

    A sole under even pressure bears the yaw moment mu F_z r, with the mean distance r of its points
    from its middle. Force and moment share the friction like the semi-axes of an ellipse.
    """
    x_min, x_max, y_min, y_max = robot.feet["left"].rectangle
    lever = _mean_distance(x_max - x_min, y_max - y_min)
    return np.asarray(
        np.hypot(dynamics.friction, dynamics.moment_z / (lever * dynamics.force[:, 2])))


@lru_cache
def _mean_distance(length: float, width: float) -> float:
    """Mean distance of a rectangle's points from its middle [m], on a fine grid."""
    share = (np.arange(200) + 0.5) / 200 - 0.5
    return float(np.hypot(length * share[:, None], width * share).mean())


def _require_rest(robot: RobotModel, motion: Motion) -> None:
    speed = np.abs(motion.joint_speed[-1])
    fastest = int(np.argmax(speed))
    if not speed[fastest] <= _STILL:
        raise WalkInfeasible(
            f"{robot.joint_names[fastest]} would still turn at {speed[fastest]:.3g} rad/s at the "
            f"end of the walk, {_STILL:g} rad/s are allowed",
            quantity="speed at the end [rad/s]", value=float(speed[fastest]), limit=_STILL,
            phase=_NAME)


def _require_margin(margin: Array, time: Array, limit: float) -> None:
    worst = int(np.argmin(margin))
    if not margin[worst] >= limit:
        raise WalkInfeasible(
            f"the ZMP would come to {1e3 * margin[worst]:.1f} mm from the edge of the soles at "
            f"{time[worst]:.2f} s, {1e3 * limit:.1f} mm are required",
            quantity="ZMP margin [m]", value=float(margin[worst]), limit=limit, phase=_NAME)


def require_friction(friction: Array, time: Array, limit: float) -> None:
    """Check the coefficients of friction that the soles need.

    Args:
        friction: Coefficients of `needed_friction`, (N,).
        time: Their times, (N,) [s].
        limit: Coefficient of friction that is assumed.

    Raises:
        WalkInfeasible: The soles would slip.
    """
    worst = int(np.argmax(friction))
    if not friction[worst] <= limit:
        raise WalkInfeasible(
            f"the soles would need a coefficient of friction of {friction[worst]:.2f} at "
            f"{time[worst]:.2f} s, {limit:.2f} is assumed",
            quantity=FRICTION, value=float(friction[worst]), limit=limit, phase=_NAME)


def _part(motion: Motion, rows: slice) -> Motion:
    yaw = motion.base_yaw
    return Motion(
        motion.time[rows], motion.joints[rows], motion.joint_speed[rows],
        motion.joint_acceleration[rows], motion.base[rows], motion.base_speed[rows],
        motion.base_acceleration[rows],
        None if yaw is None else BaseYaw(
            yaw.angle[rows], yaw.speed[rows], yaw.acceleration[rows]))


def _part_dynamics(dynamics: Dynamics, rows: slice) -> Dynamics:
    return Dynamics(dynamics.com[rows], dynamics.zmp[rows], dynamics.force[rows],
                    dynamics.moment_z[rows], dynamics.torque[rows])
