"""From footsteps to a walk: schedule, preview control, whole body, correction, checks, knots."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import Load, inverse_dynamics
from humanoid_motion.knots import Knots
from humanoid_motion.motion import Motion, min_jerk_course
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import solve

from walking.footsteps.checks import check_footsteps
from walking.footsteps.footstep import Footstep, stances
from walking.pattern.checks import check_walk
from walking.pattern.course import Course
from walking.pattern.preview import preview_control
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState, resting_upper, standing
from walking.pattern.swing import feet_courses
from walking.pattern.timing import Schedule, rest_point, schedule, zmp_reference
from walking.pattern.walk_plan import WalkPlan
from walking.pattern.whole_body import WAIST_PER_COM, BodyCourses, whole_body


def plan_walk(
    robot: RobotModel,
    state: WalkState,
    footsteps: Sequence[Footstep],
    settings: WalkSettings | None = None,
    *,
    upper: Knots | None = None,
    hand_force: Callable[[Array], Array] | None = None,
    clearance: bool = True,
) -> WalkPlan:
    """Plan a walk over footsteps that ends at rest.

    Args:
        state: State in which the walk begins: `standing`, or a state of an earlier plan.
        footsteps: The footsteps; without any, the robot comes to rest on its present stance.
        settings: Settings; None means the robot's defaults.
        upper: Course of the upper body, with times from the beginning of the walk; the legs'
            columns are ignored. None keeps the upper body as it is in `state`, or brings it to
            rest.
        hand_force: Function that returns the force of the surroundings on the hand at times (N,)
            [s] from the beginning of the walk, axes of odom, (N, 3) [N]. None keeps the force of
            `state`.
        clearance: Whether the distances between the robot's bodies are checked.

    Raises:
        InvalidFootsteps: The footsteps are bad.
        WalkInfeasible: The ZMP or friction would not be as required.
        HumanoidMotionError: A leg does not reach, a joint exceeds a limit, or bodies come too near
            to each other.
    """
    settings = settings or WalkSettings.of(robot)
    check_footsteps(robot.config, state.stance, footsteps, settings.limits)
    plan = schedule(state.stance, footsteps, settings, at_rest=state.at_rest)
    body = _body_courses(robot, state, footsteps, plan, settings, upper)
    height = com_height(robot, settings.waist_height)
    capture = state.com[0] + state.com[1] * math.sqrt(height / GRAVITY)
    reference = zmp_reference(
        robot, plan, state.zmp, None if state.at_rest else capture, settings.zmp_inward,
        settings.first_inward)
    control = preview_control(settings.period, height, settings.horizon, settings.jerk_weight)
    cart = control.follow(state.cart, reference)
    # A whole body that moves with the cart, and preview control on what its ZMP lacks.
    rolling = Course(*np.moveaxis(cart.com, 1, 0))
    rough = whole_body(robot, plan.time, rolling, body)
    force = np.tile(state.hand_force, (len(plan.time), 1)) if hand_force is None else hand_force(
        plan.time)
    lack = reference - inverse_dynamics(robot, rough, hand_load(robot, rough, force)).zmp
    correction = control.follow(state.correction, lack)
    last = stances(state.stance, footsteps)[-1]
    com = ending_at_rest(cart.com + correction.com, rest_point(robot, last), plan)
    near = (base[:, :2] + WAIST_PER_COM * (new - old) for base, new, old in zip(
        (rough.base, rough.base_speed, rough.base_acceleration), com, rolling, strict=True))
    motion = whole_body(robot, plan.time, com, body, Course(*near))
    dynamics = inverse_dynamics(robot, motion, hand_load(robot, motion, force))
    checks = check_walk(robot, motion, dynamics, plan, settings, clearance=clearance)
    knots = Knots(motion.time, motion.joints, motion.joint_speed, motion.joint_acceleration)
    return WalkPlan(
        knots=knots, motion=motion, com=dynamics.com, zmp=dynamics.zmp, zmp_reference=reference,
        schedule=plan, footsteps=tuple(footsteps),
        boundaries=tuple(
            WalkState(
                phase.stance, cart.state(phase.first), correction.state(phase.first),
                reference[phase.first], float(body.waist.value[phase.first]),
                body.upper.row(phase.first), at_rest=False, hand_force=force[phase.first])
            for phase in plan.phases if phase.kind in ("double", "end")),
        final=standing(robot, last, body.upper.value[-1]), checks=checks)


def hand_load(robot: RobotModel, motion: Motion, force: Array) -> Load | None:
    """Let forces (N, 3) [N], axes of odom, act on the hand in a motion; None if there are none."""
    if not force.any():
        return None
    yaw = None if motion.base_yaw is None else motion.base_yaw.angle
    return Load(robot.hand_chain.place(motion.joints, motion.base, yaw).end, force)


def ending_at_rest(com: Array, rest: Array, plan: Schedule) -> Course:
    """Let the course of the CoM (N, 3, 2) end exactly at rest at a place (2,) [m].

    In the second half of the end, what is left of the approach is taken away more and more: the
    motion that the last position, speed and acceleration would be part of.
    """
    end = plan.phases[-1]
    first = (end.first + end.last) // 2
    before_end = (plan.time[first:] - plan.time[-1])[:, None]
    position, speed, acceleration = com[-1] - np.vstack([rest, np.zeros((2, 2))])
    left = Course(
        position + before_end * speed + 0.5 * before_end**2 * acceleration,
        speed + before_end * acceleration,
        np.tile(acceleration, (len(before_end), 1)))
    rise = min_jerk_course(plan.time[first:] - plan.time[first], -float(before_end[0, 0]))
    taken = left.times(Course(*(rows[:, None] for rows in rise)))
    out = com.copy()
    out[first:] -= np.stack(list(taken), axis=1)
    return Course(*np.moveaxis(out, 1, 0))


def _body_courses(
    robot: RobotModel, state: WalkState, footsteps: Sequence[Footstep], plan: Schedule,
    settings: WalkSettings, upper: Knots | None,
) -> BodyCourses:
    return BodyCourses(
        feet=feet_courses(robot.config, plan, footsteps, state.stance, settings.lift),
        waist=_waist_course(robot, state, plan, settings),
        upper=resting_upper(robot, state.upper, plan.time) if upper is None
        else Course(*upper.at(plan.time)),
        chest_swing=settings.chest_swing)


def _waist_course(
    robot: RobotModel, state: WalkState, plan: Schedule, settings: WalkSettings
) -> Course:
    """The waist sinks before the first step and rises in the end."""
    time = plan.time
    found = Course.constant(state.waist_height, len(time))
    start, end = plan.phases[0], plan.phases[-1]
    moves = [(end, robot.standing_height)]
    if start.kind == "start":
        moves.insert(0, (start, settings.waist_height))
    now = state.waist_height
    for phase, target in moves:
        begin, last = time[phase.first], time[phase.last]
        course = Course(*min_jerk_course(time - begin, last - begin))
        found = found.plus(Course(*((target - now) * rows for rows in course)))
        now = target
    return found


@lru_cache(maxsize=8)
def com_height(robot: RobotModel, waist_height: float) -> float:
    """Height of the CoM above the floor with the feet beside each other [m]."""
    half = robot.config.half_sitting
    q = robot.configuration(np.zeros(3), half)
    feet = {side: robot.frame_position(q, robot.feet[side].frame) * [1.0, 1.0, 0.0]
            for side in SIDES}
    com = robot.com(q)
    joints, base = solve(robot, upper=half, com_xy=com[:2], waist_z=waist_height, feet=feet)
    return float(robot.com(robot.configuration(base[0], joints[0]))[2])

