"""The phases of a plan, made and checked for a designed hit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from hrp2_description.robot import SIDES
from humanoid_motion.clearance import Clearance, LeafCourse, bodies_of, require_clearance
from humanoid_motion.dynamics import Load, inverse_dynamics, joint_torques
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.knots import Knots, from_motion
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import require_joint_limits, require_torque_limits, shares
from humanoid_motion.zmp import margins

from impact_planner.hit.floor_load import require_grip
from impact_planner.motion.after_hit import (
    plan_after_hit,
    plan_branches,
    require_leaving,
    retreat_motion,
)
from impact_planner.motion.approach import StandingPhase, plan_approach
from impact_planner.motion.catch import LATE, hold_task
from impact_planner.motion.hit_design import HitDesign
from impact_planner.motion.hold import HoldPlan, plan_hold
from impact_planner.motion.phase_plan import Branches, PhasePlan
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import ResolvedRequest
from impact_planner.task.settings import PlannerSettings


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


_RETREAT_TIMES = (1.5, 2.0, 1.2, 1.0, 0.8)  # durations of the retreat, tried in this order [s]


def plan_phases(
    robot: RobotModel,
    known: KnownDoor,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    hit: HitDesign,
) -> tuple[tuple[PhasePlan, ...], PhasePlan, Branches]:
    """Plan and check prepare, shift, step, back, cam, post, and hold or retreat.

    Args:
        robot: The robot.
        known: The door.
        wanted: The request.
        settings: Configuration.
        hit: Design of the hit.

    Returns:
        The phases; the retreat for a cancel past the point of no return; the margins for a door
        that stands elsewhere.

    Raises:
        PlannerError: The door would not leave the robot, or cannot be held.
        HumanoidMotionError: A phase breaks a limit of joints, floor or bodies.
    """
    stance, run_up = hit.stance, hit.run_up
    after = plan_after_hit(robot, settings, hit)  # first, because it refuses most often
    require_leaving(settings, hit, after.motion)
    branches = plan_branches(robot, settings, hit, after.rest)
    approach = plan_approach(robot, stance, run_up.y_start, settings.timing, settings.period)
    limits = PhaseLimits(
        settings.required_margin, settings.limit_share, robot.config.clearance)

    def leaf_at(angle: Array, *may_touch: str) -> LeafNearby:
        """The leaf at opening angles (N,) [rad], and the links that may touch it."""
        return LeafNearby(LeafCourse(hit.placement.hinge, angle, known.width), may_touch)

    def unmoved(motion: Motion) -> Array:
        return np.full(len(motion), wanted.initial_angle)

    touching = robot.config.contact_link
    phases = [
        checked_phase(robot, phase, limits, leaf=leaf_at(unmoved(phase.motion)))
        for phase in approach
    ]
    cam = checked_phase(
        robot,
        StandingPhase("cam", run_up.motion, stance.feet, SIDES),
        limits,
        until=run_up.contact_time,
        leaf=leaf_at(unmoved(run_up.motion), touching),
    )
    post = checked_phase(
        robot,
        StandingPhase("post", after.motion, stance.feet, SIDES),
        limits,
        knots=after.knots,
        leaf=leaf_at(hit.prediction.angle_at(after.motion.time + settings.switch_delay), touching),
    )
    end = after.motion.joints[-1], after.motion.base[-1]
    retreat = _retreat(robot, known, settings, hit, limits, end)
    last = retreat
    if wanted.ending == "hold":
        last = _hold(robot, known, wanted, settings, hit, limits, end)
    every = (*phases, cam, post, last)
    require_grip(max(phase.friction for phase in (*every, retreat)), settings.sole_friction)
    return every, retreat, branches


def _hold(
    robot: RobotModel,
    known: KnownDoor,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    hit: HitDesign,
    limits: PhaseLimits,
    end: tuple[Array, Array],
) -> PhasePlan:
    """Plan the phase `hold`, in which the arm extends and holds the door.

    Args:
        robot: The robot.
        known: The door.
        wanted: The request.
        settings: Configuration.
        hit: Design of the hit.
        limits: Limits to check against.
        end: Joints (J,) [rad] and base (3,) [m] at the end of the phase `post`.
    """
    task = hold_task(
        known, settings, hit.placement.hinge, hit.stance.feet, wanted.angle, end)

    def check(hold: HoldPlan) -> PhasePlan:
        time = hold.phase.motion.time
        # Until the hand arrives, the leaf falls; its peak is detected `LATE` after it.
        falling = hit.prediction.angle_at(hit.prediction.peak_time + time + LATE)
        angle = np.where(
            time < hold.catch.reach, falling, hold.catch.angle_at(time, wanted.angle))
        leaf = LeafCourse(hit.placement.hinge, angle, known.width)
        return checked_phase(
            robot, hold.phase, limits, load=hold.load,
            leaf=LeafNearby(leaf, (robot.config.hand_link,)))

    return plan_hold(robot, task, check)


def _retreat(
    robot: RobotModel,
    known: KnownDoor,
    settings: PlannerSettings,
    hit: HitDesign,
    limits: PhaseLimits,
    end: tuple[Array, Array],
) -> PhasePlan:
    """Plan the retreat along the run-up, clear of the closing door (Fig. 12 (f)).

    Arguments are as for `_hold`.

    Raises:
        PostureUnreachable: At every duration the door comes too near to a body, or the ZMP too
            near to the soles' edge.
        JointLimit: At every duration a joint exceeds its limit.
    """
    com = robot.com(robot.configuration(end[1], end[0]))
    failure: DoorImpactError | None = None
    for duration in _RETREAT_TIMES:
        motion = retreat_motion(hit, float(com[1]), duration, settings.period)
        angle = hit.prediction.angle_at(hit.prediction.peak_time + motion.time + LATE)
        leaf = LeafNearby(LeafCourse(hit.placement.hinge, angle, known.width))
        try:
            return checked_phase(
                robot, StandingPhase("retreat", motion, hit.stance.feet, SIDES), limits, leaf=leaf)
        except (JointLimit, PostureUnreachable) as error:
            failure = failure or error
    assert failure is not None
    raise failure
