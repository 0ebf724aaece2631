"""The phases of a plan, made and checked for a designed hit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from door_model.door.frame import frame_boxes
from humanoid_motion.clearance import Clearance, LeafCourse, bodies_of, require_clearance
from humanoid_motion.dynamics import Load, inverse_dynamics, joint_torques
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.knots import Knots, from_motion
from humanoid_motion.motion import Motion
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
from impact_planner.motion.catch import LATE, HoldTask
from impact_planner.motion.hold import HoldPlan, plan_hold
from impact_planner.motion.phase_plan import Branches, PhasePlan
from impact_planner.motion.run_up import HitDesign
from impact_planner.task.request import Task

_RETREAT_TIMES = (1.5, 2.0, 1.2, 1.0, 0.8)  # durations of the retreat, tried in this order [s]


class Phases(NamedTuple):
    """The whole motion of a plan.

    Attributes:
        phases: The phases in order.
        retreat: Phase that replaces the last one after a cancel past the point of no return.
        branches: Margins for a door that does not stand where it was reported.
    """

    phases: tuple[PhasePlan, ...]
    retreat: PhasePlan
    branches: Branches


def plan_phases(task: Task, hit: HitDesign) -> Phases:
    """Plan and check prepare, shift, step, back, cam, post, and hold or retreat.

    Raises:
        PlannerError: The door would not leave the robot, or cannot be held.
        HumanoidMotionError: A phase breaks a limit of joints, floor or bodies.
    """
    robot, settings, run_up, feet = task.robot, task.settings, hit.run_up, hit.stance.feet
    after = plan_after_hit(task, hit)  # first, because it refuses most often
    require_leaving(task, hit, after.motion)
    branches = plan_branches(task, hit, after.rest)
    approach = plan_approach(robot, hit.stance, run_up.y_start, settings)

    def unmoved(motion: Motion) -> LeafCourse:
        return _leaf(task, hit, np.full(len(motion), task.wanted.initial_angle))

    touching = (robot.config.contact_link,)
    phases = [checked_phase(task, phase, unmoved(phase.motion)) for phase in approach]
    cam = checked_phase(
        task, StandingPhase("cam", run_up.motion, feet), unmoved(run_up.motion), touching,
        until=run_up.contact_time)
    opening = hit.prediction.angle_at(after.motion.time + settings.switch_delay)
    post = checked_phase(
        task, StandingPhase("post", after.motion, feet), _leaf(task, hit, opening), touching,
        knots=after.knots)
    end = after.motion.joints[-1], after.motion.base[-1]
    retreat = _retreat(task, hit, *end)
    last = retreat if task.wanted.ending == "retreat" else _hold(task, hit, *end)
    every = (*phases, cam, post, last)
    require_grip(max(phase.friction for phase in (*every, retreat)), settings.sole_friction)
    return Phases(every, retreat, branches)


def _leaf(task: Task, hit: HitDesign, angle: Array) -> LeafCourse:
    """Describe the leaf at opening angles (N,) [rad]."""
    return LeafCourse(hit.placement.hinge, angle, task.known.width)


def checked_phase(
    task: Task,
    phase: StandingPhase,
    leaf: LeafCourse,
    may_touch: tuple[str, ...] = (),
    *,
    until: float = np.inf,
    knots: Knots | None = None,
    load: Load | None = None,
) -> PhasePlan:
    """Check a motion against the limits of joints, floor and bodies, and reduce it to knots.

    Args:
        leaf: The leaf at the samples of the motion.
        may_touch: Names of the links that may touch the leaf.
        until: Time up to which ZMP, friction, torques, leaf and frame are checked [s]. The rest of
            the motion is used only as a last resort.
        knots: Knots of the motion; None means that they are made from its samples.
        load: External force on the robot; None means that no force acts.

    Raises:
        JointLimit: Position, speed or torque of a joint exceeds its limit.
        PostureUnreachable: The ZMP comes too near to the edge of the support polygon, or bodies
            come too near to each other, to the leaf, or to its frame and the wall.
    """
    robot, motion, feet, sides = task.robot, phase.motion, phase.feet, tuple(phase.feet)
    share, required = task.settings.limit_share, task.settings.required_margin
    require_joint_limits(robot, motion, phase.name, share=share)
    dynamics = inverse_dynamics(robot, motion, load)
    counted = motion.time <= until + 1e-9
    margin = float(np.min(margins(robot, dynamics.zmp, feet, sides)[counted]))
    if margin < required:
        raise PostureUnreachable(
            f"{phase.name}: the ZMP would come to {1e3 * margin:.1f} mm from the edge of the "
            f"soles, {1e3 * required:.1f} mm are required; request a smaller angle",
            quantity="ZMP margin [m]", value=margin, limit=required, phase=phase.name)
    torque = joint_torques(robot, motion, dynamics, feet, sides)[counted]
    require_torque_limits(robot, torque, phase.name, share=share)
    clearances = _clear(task, phase, leaf, may_touch, until)
    knots = knots or from_motion(motion)
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
        torque_ratio=float(np.max(shares(torque, robot.effort_limit))),
        speed_ratio=float(np.max(shares(motion.joint_speed, robot.speed_limit))),
        clearances=clearances,
        leaf=leaf,
    )


def _clear(
    task: Task, phase: StandingPhase, leaf: LeafCourse, may_touch: tuple[str, ...], until: float
) -> tuple[Clearance, ...]:
    """Check the smallest distances of bodies, as for `checked_phase`; return `clearances`."""
    bodies, limit = bodies_of(task.robot), task.robot.config.clearance
    found = [
        bodies.self_clearance(phase.motion, limit),
        bodies.leaf_clearance(phase.motion, leaf, limit, may_touch=may_touch, until=until)]
    if task.known.frame is not None:
        boxes = frame_boxes(*task.known.frame, (leaf.hinge[0], leaf.hinge[1], 0.0))
        found.append(bodies.frame_clearance(phase.motion, boxes, limit, until=until))
    for clearance in found:
        require_clearance(clearance, phase.name)
    return tuple(found)


def _at(time: Array, samples: Array, values: Array) -> Array:
    """Interpolate values (N, M) from the times `samples` (N,) to times (K,) [s]; (K, M)."""
    return np.column_stack([np.interp(time, samples, column) for column in values.T])


def _falling(hit: HitDesign, time: Array) -> Array:
    """Compute the angle of the leaf at times (N,) [s] after the detection of its peak, (N,)."""
    return hit.prediction.angle_at(hit.prediction.peak_time + time + LATE)


def _hold(task: Task, hit: HitDesign, joints: Array, base: Array) -> PhasePlan:
    """Plan the phase `hold`, in which the arm extends and holds the door.

    Args:
        joints: Joints at the end of the phase `post`, (J,) [rad].
        base: Position of base_link there, (3,) [m].
    """
    def check(hold: HoldPlan) -> PhasePlan:
        time = hold.phase.motion.time
        course = np.where(
            time < hold.catch.reach, _falling(hit, time), hold.catch.angle_at(time))
        return checked_phase(task, hold.phase, _leaf(task, hit, course),
                             (task.robot.config.hand_link,), load=hold.load)

    return plan_hold(
        HoldTask(task, hit.placement.hinge, hit.stance.feet, task.wanted.angle, joints, base),
        check)


def _retreat(task: Task, hit: HitDesign, joints: Array, base: Array) -> PhasePlan:
    """Plan the retreat along the run-up, clear of the closing door (Fig. 12 (f)).

    Arguments are as for `_hold`.

    Raises:
        PostureUnreachable: At every duration the door comes too near to a body, or the ZMP too
            near to the soles' edge.
        JointLimit: At every duration a joint exceeds its limit.
    """
    com = task.robot.com(task.robot.configuration(base, joints))
    failure: DoorImpactError | None = None
    for duration in _RETREAT_TIMES:
        motion = retreat_motion(hit, float(com[1]), duration, task.settings.period)
        leaf = _leaf(task, hit, _falling(hit, motion.time))
        try:
            return checked_phase(task, StandingPhase("retreat", motion, hit.stance.feet), leaf)
        except (JointLimit, PostureUnreachable) as error:
            failure = failure or error
    assert failure is not None
    raise failure
