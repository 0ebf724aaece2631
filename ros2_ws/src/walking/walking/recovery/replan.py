"""A new walk from within a single support: the swing foot lands elsewhere and at another time."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.dynamics import inverse_dynamics
from humanoid_motion.knots import Knots, quintic

from walking.footsteps.footstep import OUTWARD, Footstep, as_array, other, wrapped
from walking.footsteps.soles import sole_distances
from walking.pattern.course import Course


def quintic_course(begin: Course, end: Array, duration: float, time: Array) -> Course:
    """Compute a course from a state to rest.

    Args:
        begin: Value, speed and acceleration at time 0, (M,) each.
        end: Value at the end, (M,).
        duration: Time to the end [s].
        time: Times, (N,) [s]; the end's value holds after the end.
    """
    zero = np.zeros_like(end)
    d = duration
    c = quintic(begin.value, begin.speed * d, begin.acceleration * d * d, end, zero, zero)
    x = np.clip(time / d, 0.0, 1.0)[:, None]
    value = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))))
    speed = c[1] + x * (2 * c[2] + x * (3 * c[3] + x * (4 * c[4] + x * 5 * c[5])))
    acceleration = 2 * c[2] + x * (6 * c[3] + x * (12 * c[4] + x * 20 * c[5]))
    inside = (time < d - 1e-9)[:, None]
    return Course(value, np.where(inside, speed / d, 0.0), np.where(inside, acceleration / d**2, 0.0))


def swing_course(
    robot, side, begin, end, standing, duration, time, upright=0.04, lift=0.045, clearance=0.02,
):
    """Course x, y, z, yaw (N, 4) of a swing foot from its present state to rest on the floor."""
    flat = [0, 1, 3]
    part = Course(*(rows[flat] for rows in begin))
    travel = quintic_course(part, end, duration - upright, time)
    up = quintic_course(Course(*(rows[2:3] for rows in begin)), np.zeros(1), duration, time)
    # Lift what the present height lacks.
    u = np.clip(time / duration, 0.0, 1.0)
    hump, slope = 4.0 * u * (1.0 - u), 4.0 - 8.0 * u
    shape = Course(hump**3, 3.0 * hump**2 * slope / duration,
                   (6.0 * hump * slope**2 - 24.0 * hump**2) / duration**2)
    lack = max(0.0, lift - float(up.value.max()))
    still = np.tile(standing, (len(time), 1))
    outward = OUTWARD[side] * np.array([-np.sin(standing[2]), np.cos(standing[2])])
    detour = 0.0
    for _ in range(6):
        out = []
        for t_rows, u_rows, s_rows in zip(travel, up, shape, strict=True):
            rows = np.empty((len(time), 4))
            rows[:, flat] = t_rows
            rows[:, :2] += s_rows[:, None] * detour * outward
            rows[:, 2] = u_rows[:, 0] + lack * s_rows
            out.append(rows)
        course = Course(*out)
        gap = sole_distances(robot.config, side, course.value[:, flat], still)
        short = min(clearance, gap[0], gap[-1]) - gap.min()
        if short < 1e-4:
            break
        detour += 1.5 * short
    return course


def com_course(control, start, zmp, reference, blend, time):
    """Course of the CoM's reference, and the course of the CoM that is expected."""
    from walking.pattern.preview import CartState
    cart = control.follow(CartState(start, np.zeros(2)), zmp)
    plan = Course(*np.moveaxis(cart.com, 1, 0))
    gap = Course(*(p[0] - r for p, r in zip(plan, reference, strict=True)))
    axes, durations = blend
    parts = [quintic_course(Course(*(rows @ axis[:, None] for rows in gap)), np.zeros(1), duration, time)
             for axis, duration in zip(axes, durations, strict=True)]
    delta = Course(*(sum(rows * axis for rows, axis in zip(both, axes, strict=True))
                     for both in zip(*parts, strict=True)))
    return Course(*(p - d for p, d in zip(plan, delta, strict=True))), plan


def plan_landing(robot, state, landing, com, velocity, frequency, settings, walk, height, gone=0.0):
    """landing None: both feet stay."""
    from humanoid_motion.whole_body import require_joint_limits

    from walking.pattern.plan import _com_height, _ending_at_rest
    from walking.pattern.preview import CartState, preview_control
    from walking.pattern.state import WalkState, rest_height
    from walking.pattern.state import standing as standing_state
    from walking.pattern.timing import Phase, Schedule
    from walking.pattern.walk_plan import WalkChecks, WalkPlan
    from walking.pattern.whole_body import BodyCourses, whole_body
    from walking.pattern.zmp_reference import rest_point

    period = walk.period
    n2 = round(settings.end / period)
    stance = state.stance
    if landing is None:
        n1, steps, after = 0, (), stance
        schedule = Schedule((Phase("end", 0, n2, stance, 0, ""),), period)
        time = schedule.time
        middle = stance.middle.yaw
        feet = {}
        for side in ("left", "right"):
            still = as_array(stance.foot(side))
            still[2] = middle + wrapped(still[2] - middle)
            feet[side] = Course.constant(np.insert(still, 2, 0.0), len(time))
    else:
        n0 = round(landing.double / period)
        n1 = n0 + max(1, round((landing.time - landing.double) / period))
        swing = landing.swing
        step = Footstep(swing, *landing.pose)
        steps = (step,)
        after = stance.after(step)
        phases = [Phase("single", n0, n1, stance, 0, swing),
                  Phase("end", n1, n1 + n2, after, 1, "")]
        if n0:
            phases.insert(0, Phase("double", 0, n0, stance, 0, swing))
        schedule = Schedule(tuple(phases), period)
        time = schedule.time
        standing_side = other(swing)
        still = as_array(stance.foot(standing_side))
        end = as_array(landing.pose)
        if n0:
            here = as_array(stance.foot(swing))
            begin = Course.constant(np.insert(here, 2, 0.0), 1)
            begin = Course(*(rows[0] for rows in begin))
        else:
            begin = state.foot
        end[2] = begin.value[3] + wrapped(end[2] - begin.value[3])
        still[2] = begin.value[3] + wrapped(still[2] - begin.value[3])
        foot = swing_course(robot, swing, begin, end, still, (n1 - n0) * period, time[:len(time) - n0])
        if n0:
            foot = Course(*(np.vstack([np.tile(rows[:1], (n0, 1)), rows]) for rows in foot))
        foot.value[n1:] = np.insert(end, 2, 0.0)
        foot.speed[n1:] = 0.0
        foot.acceleration[n1:] = 0.0
        feet = {swing: foot,
                standing_side: Course.constant(np.insert(still, 2, 0.0), len(time))}
    control = preview_control(period, _com_height(robot, walk.waist_height), walk.horizon,
                              walk.jerk_weight)
    rest = rest_point(robot, after)
    first = com - state.com.acceleration / frequency**2
    if landing is None:
        zmp = np.tile(rest, (len(time), 1))
        start = np.vstack([com, velocity, state.com.acceleration])
    else:
        ramp = np.clip((np.arange(len(time)) - n1) / max(1, round(settings.ramp / period)), 0.0, 1.0)[:, None]
        zmp = landing.zmp + ramp * (rest - landing.zmp)
        start = np.vstack([com, velocity, frequency**2 * (com - landing.zmp)])
    swings = landing.swing if landing is not None else ""
    outward = OUTWARD[other(swings)] if swings else 0.0
    yaw = stance.foot(other(swings)).yaw if swings else stance.middle.yaw
    axes = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    off = axes @ (com + velocity / frequency - state.com.value - state.com.speed / frequency)
    slow = off[1] * outward > 0.4 * np.linalg.norm(off)
    whole = settings.outward if slow else settings.blend
    blend = axes, (max(settings.least, whole - gone),) * 2
    course, expected = com_course(control, start, zmp, state.com, blend, time)
    course = _ending_at_rest(np.stack(list(course), axis=1), rest, schedule)
    one = lambda c: Course(*(np.atleast_1d(r) for r in c))
    waist = quintic_course(one(state.waist), np.array([rest_height(robot)]), float(time[-1]), time)
    upper = quintic_course(state.upper, state.upper.value, 0.4, time)
    body = BodyCourses(feet=feet, waist=Course(*(rows[:, 0] for rows in waist)), upper=upper,
                       chest_swing=walk.chest_swing)
    motion = whole_body(robot, time, course, body)
    require_joint_limits(robot, motion, "recovery step", share=0.95)
    dynamics = inverse_dynamics(robot, motion)
    knots = Knots(motion.time, motion.joints, motion.joint_speed, motion.joint_acceleration)
    final = standing_state(robot, after, upper.value[-1])
    com_now = np.stack([rows[n1] for rows in course])
    boundary = WalkState(after, CartState(com_now, np.zeros(2)), CartState.at_rest(np.zeros(2)), zmp[n1],
                         float(waist.value[n1, 0]), upper.value[n1], at_rest=False)
    checks = WalkChecks(np.zeros(len(time)), np.zeros(1), np.zeros(1), 0.0, None)
    return WalkPlan(knots, motion, dynamics.com, dynamics.zmp, zmp, schedule, steps, (boundary,),
                    final, checks), expected
