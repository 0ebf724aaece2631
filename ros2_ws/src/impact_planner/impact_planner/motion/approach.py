"""The phases before the run-up: lower the waist, shift, step, go back.

All are slow: the CoM follows minimum-jerk courses that begin and end at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.motion import Motion, min_jerk, rest_to_rest, still
from humanoid_motion.robot_model import RobotModel, braced_upper_body
from humanoid_motion.whole_body import require_joint_limits, solve, within_ranges

from impact_planner.hit.posture import RESERVE
from impact_planner.hit.stance import (
    SINGLE_SUPPORT_MARGIN,
    HitStance,
    braced_over,
    com_x,
    initial_base,
)
from impact_planner.task.settings import ApproachTiming

# Part of the step's time in which the foot travels; it rises before and sinks after that.
_TRAVEL = (0.12, 0.88)
_NODES = 0.05  # postures are solved so often and a spline laid through them [s]


@dataclass(frozen=True)
class StandingPhase:
    """A phase whose carrying feet do not move.

    Attributes:
        name: Name of the phase.
        motion: Samples.
        feet: Soles that carry, by side, (3,) each [m].
        sides: Sides that carry.
    """

    name: str
    motion: Motion
    feet: dict[str, Array]
    sides: tuple[str, ...]


def plan_approach(
    robot: RobotModel, stance: HitStance, y_run_up: float, timing: ApproachTiming, period: float
) -> list[StandingPhase]:
    """Everything from half-sitting to the start of the run-up.

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        y_run_up: y of the CoM where the run-up starts [m].
        timing: Durations.
        period: Sampling period [s].

    Returns:
        The phases prepare, shift, step and back.

    Raises:
        PostureUnreachable: A leg does not reach.
        JointLimit: The step is too long for the hips while the left foot carries.
    """
    start, placed = stance.feet_start, stance.feet
    x, height = com_x(robot), stance.posture.waist_height
    over_left = _over_left_foot(robot, stance)
    prepare = _prepare(robot, stance, np.array([x, 0.0]), timing.prepare, period)
    shift = _sway(robot, start, height, (0.0, over_left), timing.shift, period)
    step = _step(robot, stance, np.array([x, over_left]), timing, period)
    back = _sway(robot, placed, height, (over_left, y_run_up), timing.back, period)
    return [
        StandingPhase("prepare", prepare, start, SIDES),
        StandingPhase("shift", shift, start, SIDES),
        StandingPhase("step", step, {"left": start["left"]}, ("left",)),
        StandingPhase("back", back, placed, SIDES),
    ]


def sample_times(duration: float, period: float) -> Array:
    """Evenly spaced times from 0 to a duration, at most a period apart, (N,) [s]."""
    return np.linspace(0.0, duration, max(8, int(np.ceil(duration / period - 1e-9)) + 1))


def _over_left_foot(robot: RobotModel, stance: HitStance) -> float:
    """y of the CoM during the step: as near to the middle of the sole as the hip roll allows."""
    edges = robot.feet["left"].corners(stance.feet_start["left"])[:, 1]
    middle, inner = float(edges.mean()), float(edges.min())
    candidates = np.arange(middle, inner + SINGLE_SUPPORT_MARGIN - 1e-9, -0.0025)
    height = stance.posture.waist_height
    joints, _ = braced_over(robot, candidates, height, stance.feet, strict=False)
    within = np.all(within_ranges(robot, joints, RESERVE), axis=1)
    if within.any():
        return float(candidates[np.argmax(within)])
    joints, base = braced_over(robot, candidates[-1:], height, stance.feet)  # says why not
    require_joint_limits(robot, still(joints[0], base[0]), "step", reserve=RESERVE)
    return float(candidates[-1])


def _prepare(
    robot: RobotModel, stance: HitStance, com_end: Array, duration: float, period: float
) -> Motion:
    time = sample_times(duration, _NODES)
    part = min_jerk(time, duration)[:, None]
    begin = initial_base(robot)
    relaxed, braced = robot.config.half_sitting, braced_upper_body(robot)
    com_begin = robot.com(robot.configuration(begin, relaxed))[:2]
    joints, base = solve(
        robot,
        upper=relaxed + part * (braced - relaxed),
        com_xy=com_begin + part * (com_end - com_begin),
        waist_z=begin[2] + part[:, 0] * (stance.posture.waist_height - begin[2]),
        feet=stance.feet_start,
    )
    return rest_to_rest(time, joints, base, sample_times(duration, period))


def _sway(
    robot: RobotModel,
    feet: dict[str, Array],
    height: float,
    y: tuple[float, float],
    duration: float,
    period: float,
) -> Motion:
    time = sample_times(duration, _NODES)
    course = y[0] + min_jerk(time, duration) * (y[1] - y[0])
    joints, base = braced_over(robot, course, height, feet)
    return rest_to_rest(time, joints, base, sample_times(duration, period))


def _step(
    robot: RobotModel, stance: HitStance, com: Array, timing: ApproachTiming, period: float
) -> Motion:
    time = sample_times(timing.step, _NODES)
    u = time / timing.step
    travel = min_jerk((u - _TRAVEL[0]) / (_TRAVEL[1] - _TRAVEL[0]), 1.0)[:, None]
    begin, end = stance.feet_start["right"], stance.feet["right"]
    right = begin + travel * (end - begin)
    right[:, 2] += robot.config.step.lift * (4.0 * u * (1.0 - u)) ** 3
    joints, base = solve(
        robot,
        upper=braced_upper_body(robot),
        com_xy=np.tile(com, (len(time), 1)),
        waist_z=stance.posture.waist_height,
        feet={"left": stance.feet_start["left"], "right": right},
    )
    return rest_to_rest(time, joints, base, sample_times(timing.step, period))
