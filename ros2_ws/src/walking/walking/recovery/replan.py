"""A new walk after a push, from the middle of a step or from both feet.

The plan begins with the positions, velocities and accelerations of the present reference. Its CoM
is at first where the reference's is, and goes over to where the measured one is going: the body
then stands upright again. A body that falls towards the side of its standing foot is given more
time: to turn it upright would push the CoM on in the direction of the fall.
"""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import Dynamics, inverse_dynamics, joint_torques
from humanoid_motion.knots import Knots
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import require_joint_limits, shares

from walking.footsteps.footstep import OUTWARD, Footstep, Stance, as_array, other, wrapped
from walking.pattern.checks import needed_friction, soles_of, zmp_margins
from walking.pattern.course import Course, to_rest
from walking.pattern.plan import com_height, ending_at_rest
from walking.pattern.preview import CartState, preview_control
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState, standing
from walking.pattern.swing import clear_of, hump
from walking.pattern.timing import Phase, Schedule, rest_point
from walking.pattern.walk_plan import WalkChecks, WalkPlan
from walking.pattern.whole_body import BodyCourses, whole_body
from walking.recovery.adaptation import UPRIGHT, Landing
from walking.recovery.estimate import ReferenceState

_OUTWARD = 0.4  # share of the error across the standing foot from which the robot falls outward
_UPPER = 0.4  # time in which the upper body comes to rest [s]
# Time in which the reference of the CoM joins the measured one; the same if the robot falls to the
# side of its standing foot; and the shortest that a plan that was changed anew is left else [s].
_BLEND, _BLEND_OUTWARD, _BLEND_LEAST = 0.5, 1.4, 0.45
_SETTLE = 0.3  # time after touchdown in which the ZMP moves between the soles [s]
_END = 1.4  # time from touchdown to rest [s]
# Height of the swing foot in the middle of a step [m]; the same in a short one, in which a knee
# is not fast enough for it, per time of its single support [m/s].
_LIFT, _RISE = 0.045, 0.115


def plan_landing(
    robot: RobotModel, state: ReferenceState, landing: Landing, com: Array, frequency: float,
    walk: WalkSettings, passed: float,
) -> tuple[WalkPlan, Course]:
    """Plan a step to a landing and the way to rest on both feet.

    Args:
        state: State of the reference in which the plan begins.
        landing: Where and when the foot lands.
        com: Measured position and velocity of the CoM then, (2, 2) [m, m/s].
        frequency: Frequency of the pendulum [rad/s].
        passed: Time since the first change after the push [s].

    Returns:
        The plan, and the expected course of the CoM, (N, 2) each.

    Raises:
        HumanoidMotionError: A leg does not reach, or a joint would leave its range or be too fast.
    """
    step = Footstep(landing.side, *landing.pose)
    plan = _schedule(state.stance, step, landing, walk.period)
    time, lifted, landed = plan.time, plan.phases[-2].first, plan.phases[-1].first
    after = plan.phases[-1].stance
    rest = rest_point(robot, after)
    ramp = np.clip((time - time[landed]) / _SETTLE, 0.0, 1.0)[:, None]
    zmp = landing.zmp + ramp * (rest - landing.zmp)
    cart = CartState(np.vstack([com, frequency**2 * (com[0] - landing.zmp)]), np.zeros(2))
    control = preview_control(
        walk.period, com_height(robot, walk.waist_height), walk.horizon, walk.jerk_weight)
    expected = Course(*np.moveaxis(control.follow(cart, zmp).com, 1, 0))
    blend = _blend(state, landing, com, frequency, passed)
    gap = Course(*(rows[0] - now for rows, now in zip(expected, state.com, strict=True)))
    left = to_rest(gap, np.zeros(2), blend, time)
    course = ending_at_rest(
        np.stack([rows - gone for rows, gone in zip(expected, left, strict=True)], axis=1),
        rest, plan)
    waist = to_rest(Course(*(np.atleast_1d(rows) for rows in state.waist)),
                    np.array([robot.standing_height]), float(time[-1]), time)
    upper = to_rest(state.upper, state.upper.value, _UPPER, time)
    body = BodyCourses(
        _feet(robot, state, step, time, lifted, landed),
        Course(*(rows[:, 0] for rows in waist)), upper, walk.chest_swing)
    motion = whole_body(robot, time, course, body)
    require_joint_limits(robot, motion, "recovery step")
    dynamics = inverse_dynamics(robot, motion)
    found = WalkPlan(
        knots=Knots(motion.time, motion.joints, motion.joint_speed, motion.joint_acceleration),
        motion=motion, com=dynamics.com, zmp=dynamics.zmp, zmp_reference=zmp, schedule=plan,
        footsteps=(step,),
        boundaries=tuple(
            WalkState(
                plan.phases[index].stance,
                CartState(np.stack([rows[sample] for rows in course]), np.zeros(2)),
                CartState.at_rest(np.zeros(2)), zmp[sample], float(waist.value[sample, 0]),
                upper.row(sample), at_rest=False)
            for index, sample in ((0, 0), (-1, landed))),
        final=standing(robot, after, upper.value[-1]),
        checks=_checks(robot, motion, dynamics, plan))
    return found, expected


def swing_to(
    robot: RobotModel, side: str, begin: Course, end: Array, standing_sole: Array, lift: float,
    time: Array,
) -> Course:
    """Compute the course of a swing foot from a state in the air or on the floor to rest.

    Args:
        side: Side of the foot.
        begin: x, y, z [m] and yaw [rad] with derivatives at time 0, (4,) each.
        end: x, y [m] and yaw [rad] at touchdown, (3,).
        standing_sole: The same of the other sole, (3,).
        lift: Height that the foot reaches at least [m].
        time: Times from 0 to touchdown, (N,) [s].

    Returns:
        x, y, z [m] and yaw [rad], (N, 4).
    """
    duration, flat = float(time[-1]), [0, 1, 3]
    travel = to_rest(Course(*(rows[flat] for rows in begin)), end,
                     max(duration - UPRIGHT, UPRIGHT), time)
    down = to_rest(Course(*(rows[2:3] for rows in begin)), np.zeros(1), duration, time)
    rise = hump(time, duration)
    lack = max(0.0, lift - float(down.value.max()))

    def swung(aside: Array) -> Course:
        return Course(*(
            np.column_stack([
                along[:, :2] + bump[:, None] * aside, z[:, 0] + lack * bump, along[:, 2]])
            for along, z, bump in zip(travel, down, rise, strict=True)))

    return clear_of(robot.config, side, standing_sole, swung)


def _schedule(stance: Stance, step: Footstep, landing: Landing, period: float) -> Schedule:
    lifted = round(landing.double / period)
    landed = lifted + max(1, round((landing.time - landing.double) / period))
    phases = [Phase("single", lifted, landed, stance, 0, step.side),
              Phase("end", landed, landed + round(_END / period), stance.after(step), 1, "")]
    if lifted:
        phases.insert(0, Phase("double", 0, lifted, stance, 0, step.side))
    return Schedule(tuple(phases), period)


def _blend(
    state: ReferenceState, landing: Landing, com: Array, frequency: float, passed: float
) -> float:
    """Return the time in which the reference of the CoM joins the measured one [s]."""
    side = other(landing.side)
    yaw = state.stance.foot(side).yaw
    off = com[0] + com[1] / frequency - state.com.value - state.com.speed / frequency
    across = OUTWARD[side] * float(np.array([-np.sin(yaw), np.cos(yaw)]) @ off)
    outward = across > _OUTWARD * float(np.linalg.norm(off))
    return _BLEND_OUTWARD if outward else max(_BLEND_LEAST, _BLEND - passed)


def _feet(
    robot: RobotModel, state: ReferenceState, step: Footstep, time: Array, lifted: int, landed: int,
) -> dict[str, Course]:
    side, count = step.side, len(time)
    still = as_array(state.stance.foot(other(side)))
    end = as_array(step.pose)
    if state.swing:
        begin = state.foot
    else:
        here = np.insert(as_array(state.stance.foot(side)), 2, 0.0)
        here[3] = still[2] + wrapped(here[3] - still[2])
        begin = Course(here, np.zeros(4), np.zeros(4))
    for pose in (still, end):
        pose[2] = begin.value[3] + wrapped(pose[2] - begin.value[3])
    foot = Course.constant(np.insert(end, 2, 0.0), count)
    lift = min(_LIFT, _RISE * float(time[landed] - time[lifted]))
    swing = swing_to(robot, side, begin, end, still, lift,
                     time[lifted : landed + 1] - time[lifted])
    for rows, new in zip(foot, swing, strict=True):
        rows[:lifted] = new[0]
        rows[lifted : landed + 1] = new
    return {side: foot, other(side): Course.constant(np.insert(still, 2, 0.0), count)}


def _checks(
    robot: RobotModel, motion: Motion, dynamics: Dynamics, plan: Schedule
) -> WalkChecks:
    """Compute what is checked in a walk; only the joints' limits bind a recovery step.

    The ZMP here is that of the reference, which is not that of the tilted robot.
    """
    feet, yaw = soles_of(plan.phases[-1])
    torque = joint_torques(robot, motion, dynamics, feet, SIDES, yaw)
    return WalkChecks(
        margin=zmp_margins(robot, dynamics.zmp, plan),
        speed_ratio=shares(motion.joint_speed, robot.speed_limit).max(axis=0),
        torque_ratio=shares(torque[plan.phases[-1].first:], robot.effort_limit).max(axis=0),
        friction=needed_friction(robot, dynamics),
        clearance=None)
