"""Courses of the feet: the sole that swings, and soles that stand still."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, RobotConfig, needed
from humanoid_motion.motion import min_jerk_course

from walking.footsteps.checks import sole_distances
from walking.footsteps.footstep import OUTWARD, Footstep, Stance, as_array, other, wrapped
from walking.pattern.course import Course
from walking.pattern.timing import Schedule

# Time after lift-off and before touchdown in which the foot moves up and down only [s]. It is a
# whole number of samples, because the jerk jumps where the travel begins and ends.
_UPRIGHT = 0.04
_TRIES = 8  # largest number of detours that are tried
_NEAR = 1e-4  # by how much a foot may come nearer to the other than its clearance [m]


def swing(
    begin: Array, end: Array, detour: Array, lift: float, time: Array, upright: float
) -> Course:
    """Compute the course of a swing foot, which begins and ends at rest on the floor.

    Args:
        begin: x, y [m] and yaw [rad] before the step, (3,).
        end: x, y [m] and yaw [rad] after the step, (3,).
        detour: By how much the foot is aside of the straight way in the middle, (2,) [m].
        lift: Height in the middle of the swing [m].
        time: Times since the beginning of the swing, up to its end, (N,) [s].
        upright: Time at both ends in which the foot moves up and down only [s].

    Returns:
        x, y, z [m] and yaw [rad] of the sole with its derivatives, (N, 4) each.
    """
    duration = float(time[-1])
    travelling = duration - 2.0 * upright
    travel = min_jerk_course(time - upright, travelling)
    aside, height = hump(time - upright, travelling), hump(time, duration)
    out = Course(*(np.empty((len(time), 4)) for _ in range(3)))
    for rows, along, away, up in zip(out, travel, aside, height, strict=True):
        rows[:, [0, 1, 3]] = along[:, None] * (end - begin)
        rows[:, :2] += away[:, None] * detour
        rows[:, 2] = lift * up
    out.value[:, [0, 1, 3]] += begin
    return out


def hump(time: Array, duration: float) -> Course:
    """Rise from 0 to 1 and back: a polynomial with three zeros at each end, at rest there."""
    u = np.clip(time / duration, 0.0, 1.0)
    rise, slope = 4.0 * u * (1.0 - u), 4.0 - 8.0 * u
    return Course(rise**3, 3.0 * rise**2 * slope / duration,
                  (6.0 * rise * slope**2 - 24.0 * rise**2) / duration**2)


def clear_of(
    robot: RobotConfig, side: str, standing: Array, swung: Callable[[Array], Course]
) -> Course:
    """Swing a foot around the standing one, as far outward as its clearance demands.

    Args:
        side: Side of the foot that swings.
        standing: x, y [m] and yaw [rad] of the other sole, (3,).
        swung: Function that computes the course x, y, z [m] and yaw [rad], (N, 4), of the foot
            from how far it is aside of its straight way in the middle, (2,) [m].
    """
    outward = OUTWARD[side] * np.array([-np.sin(standing[2]), np.cos(standing[2])])
    detour = 0.0
    for _ in range(_TRIES):
        course = swung(detour * outward)
        flat = course.value[:, [0, 1, 3]]
        gap = sole_distances(robot, side, flat, np.tile(standing, (len(flat), 1)))
        lack = min(needed(robot.footsteps, "footsteps").clearance, gap[0], gap[-1]) - gap.min()
        if lack < _NEAR:
            break
        detour += 1.5 * float(lack)
    return course


def feet_courses(
    robot: RobotConfig, plan: Schedule, footsteps: Sequence[Footstep], stance: Stance, lift: float
) -> dict[str, Course]:
    """Compute the courses of both soles through a walk.

    Args:
        stance: The soles at the beginning.
        lift: Height of the swing foot in the middle of a step [m].

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
        begin, standing = now[phase.swing], now[other(phase.swing)]
        end = as_array(footsteps[phase.step].pose)
        end[2] = begin[2] + wrapped(end[2] - begin[2])
        time = plan.time[: phase.last - phase.first + 1]
        upright = float(time[min(round(_UPRIGHT / plan.period), len(time) // 4)])
        course = clear_of(robot, phase.swing, standing, partial(
            swing, begin, end, lift=lift, time=time, upright=upright))
        foot = found[phase.swing]
        for rows, new in zip(foot, course, strict=True):
            rows[phase.first : phase.last + 1] = new
        foot.value[phase.last :] = np.insert(end, 2, 0.0)
        now[phase.swing] = end
    return found
