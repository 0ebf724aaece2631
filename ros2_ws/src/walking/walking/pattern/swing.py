"""Courses of the feet: the sole that swings, and soles that stand still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.motion import min_jerk_course

from walking.footsteps.footstep import Footstep, Stance, as_array, wrapped
from walking.pattern.course import Course
from walking.pattern.settings import WalkSettings
from walking.pattern.timing import Schedule

# Start and end of the horizontal travel as shares of the swing's time: near the floor the foot
# moves up and down only.
_TRAVEL = (0.06, 0.94)


def swing(begin: Array, end: Array, lift: float, share: Array, duration: float) -> Course:
    """Compute the course of a swing foot, which begins and ends at rest on the floor.

    Args:
        begin: x, y [m] and yaw [rad] before the step, (3,).
        end: x, y [m] and yaw [rad] after the step, (3,).
        lift: Height in the middle of the swing [m].
        share: Time since the beginning of the swing as a share of its duration, (N,).
        duration: Duration of the swing [s].

    Returns:
        x, y, z [m] and yaw [rad] of the sole with its derivatives, (N, 4) each.
    """
    first, last = _TRAVEL
    rise, speed, acceleration = min_jerk_course(
        duration * (share - first), duration * (last - first))
    whole = np.asarray(end - begin)[None, :]
    out = Course(*(np.empty((len(share), 4)) for _ in range(3)))
    for rows, course in zip(out, (rise, speed, acceleration), strict=True):
        rows[:, [0, 1, 3]] = course[:, None] * whole
    out.value[:, [0, 1, 3]] += begin
    # The height is a polynomial with three zeros at each end: no speed or acceleration there.
    u = np.clip(share, 0.0, 1.0)
    hump, slope = 4.0 * u * (1.0 - u), 4.0 - 8.0 * u
    out.value[:, 2] = lift * hump**3
    out.speed[:, 2] = lift * 3.0 * hump**2 * slope / duration
    out.acceleration[:, 2] = lift * (6.0 * hump * slope**2 - 24.0 * hump**2) / duration**2
    return out


def feet_courses(
    plan: Schedule, footsteps: Sequence[Footstep], stance: Stance, settings: WalkSettings
) -> dict[str, Course]:
    """Compute the courses of both soles through a walk.

    Args:
        plan: The schedule.
        footsteps: The footsteps.
        stance: The soles at the beginning.
        settings: Settings.

    Returns:
        x, y, z [m] and yaw [rad] of each sole in odom with derivatives, (N, 4) each, by side; yaw
        has no jumps.
    """
    count = len(plan.time)
    # Headings begin within half a turn of each other, so that their mean is that of the body.
    heading = stance.middle.yaw
    now = {side: as_array(stance.foot(side)) for side in SIDES}
    for pose in now.values():
        pose[2] = heading + wrapped(pose[2] - heading)
    found = {side: Course.constant(np.insert(now[side], 2, 0.0), count) for side in SIDES}
    for phase in plan.phases:
        if phase.kind != "single":
            continue
        begin = now[phase.swing]
        end = as_array(footsteps[phase.step].pose)
        end[2] = begin[2] + wrapped(end[2] - begin[2])
        steps = phase.last - phase.first
        course = swing(
            begin, end, settings.lift, np.arange(steps + 1) / steps, steps * plan.period)
        foot = found[phase.swing]
        for rows, new in zip(foot, course, strict=True):
            rows[phase.first : phase.last + 1] = new
        foot.value[phase.last :] = np.insert(end, 2, 0.0)
        now[phase.swing] = end
    return found
