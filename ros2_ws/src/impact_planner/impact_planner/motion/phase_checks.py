"""Check of a sampled motion against every limit, and its reduction to a phase of a plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.clearance import Clearance, LeafCourse, bodies_of, require_clearance
from humanoid_motion.dynamics import Load, inverse_dynamics, joint_torques
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.knots import Knots, from_motion
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import require_joint_limits, require_torque_limits, shares
from humanoid_motion.zmp import margins

from impact_planner.motion.approach import StandingPhase
from impact_planner.motion.phase_plan import PhasePlan


@dataclass(frozen=True)
class PhaseLimits:
    """Limits of a phase.

    Attributes:
        margin: Smallest allowed ZMP margin [m].
        share: Largest allowed share of the joints' speed and torque limits.
        clearance: Smallest allowed distance between bodies that must not touch [m].
    """

    margin: float
    share: float
    clearance: float


@dataclass(frozen=True)
class LeafNearby:
    """The leaf during a phase.

    Attributes:
        course: Places of the leaf at the samples of the motion.
        may_touch: Names of the links that may touch the leaf.
    """

    course: LeafCourse
    may_touch: tuple[str, ...] = ()


def checked_phase(
    robot: RobotModel,
    phase: StandingPhase,
    limits: PhaseLimits,
    *,
    until: float = np.inf,
    knots: Knots | None = None,
    load: Load | None = None,
    leaf: LeafNearby | None = None,
) -> PhasePlan:
    """Check a motion against the limits of joints, floor and bodies, and reduce it to knots.

    Args:
        robot: The robot.
        phase: The motion and the supporting soles.
        limits: Limits to check against.
        until: Time up to which ZMP, friction, torques and the leaf are checked [s]. The rest of
            the motion is used only as a last resort.
        knots: Knots of the motion; None means that they are made from its samples.
        load: External force on the robot; None means that no force acts.
        leaf: The leaf; None means that its clearance is not checked.

    Raises:
        JointLimit: Position, speed or torque of a joint exceeds its limit.
        PostureUnreachable: The ZMP comes too near to the edge of the support polygon, or bodies
            come too near to each other or to the leaf.
    """
    motion = phase.motion
    require_joint_limits(robot, motion, phase.name, share=limits.share)
    dynamics = inverse_dynamics(robot, motion, load)
    distance = margins(robot, dynamics.zmp, phase.feet, phase.sides)
    counted = motion.time <= until + 1e-9
    margin = float(np.min(distance[counted]))
    if margin < limits.margin:
        raise PostureUnreachable(
            f"{phase.name}: the ZMP would come to {1e3 * margin:.1f} mm from the edge of the "
            f"soles, {1e3 * limits.margin:.1f} mm are required; request a smaller angle",
            quantity="ZMP margin [m]",
            value=margin,
            limit=limits.margin,
            phase=phase.name,
        )
    torque = joint_torques(robot, motion, dynamics, phase.feet, phase.sides)
    require_torque_limits(robot, torque[counted], phase.name, share=limits.share)
    clearances = _clear(robot, phase, limits, until, leaf)
    if knots is None:
        knots, _ = from_motion(motion)
    return PhasePlan(
        name=phase.name,
        knots=knots,
        com=_at(knots.time, motion.time, dynamics.com),
        zmp=_at(knots.time, motion.time, dynamics.zmp),
        time=motion.time,
        com_samples=dynamics.com,
        zmp_samples=dynamics.zmp,
        margin=margin,
        friction=float(np.max(dynamics.friction[counted])),
        torque_ratio=float(np.max(shares(torque[counted], robot.effort_limit))),
        speed_ratio=float(np.max(shares(motion.joint_speed, robot.speed_limit))),
        clearances=clearances,
        leaf=None if leaf is None else leaf.course,
    )


def _clear(
    robot: RobotModel,
    phase: StandingPhase,
    limits: PhaseLimits,
    until: float,
    leaf: LeafNearby | None,
) -> tuple[Clearance, ...]:
    """Smallest distances between bodies and to the leaf.

    Raises:
        PostureUnreachable: A distance is below its limit.
    """
    found = [bodies_of(robot).self_clearance(phase.motion, limits.clearance)]
    if leaf is not None:
        found.append(bodies_of(robot).leaf_clearance(
            phase.motion, leaf.course, limits.clearance, may_touch=leaf.may_touch, until=until))
    for clearance in found:
        require_clearance(clearance, phase.name)
    return tuple(found)


def _at(time: Array, samples: Array, values: Array) -> Array:
    """Values (N, M) at the times `samples` (N,) [s], interpolated at times (K,) [s]; (K, M)."""
    return np.column_stack([np.interp(time, samples, column) for column in values.T])
