"""The phases of a plan, made and checked for a designed hit."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from hrp2_description.robot import SIDES
from humanoid_motion.clearance import LeafCourse
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel

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
from impact_planner.motion.phase_checks import LeafNearby, PhaseLimits, checked_phase
from impact_planner.motion.phase_plan import Branches, PhasePlan
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import ResolvedRequest
from impact_planner.task.settings import PlannerSettings

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
