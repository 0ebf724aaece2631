"""The phases before the run-up: prepare, shift, step and back.

The CoM follows minimum-jerk courses. Each motion is as short as joints and ZMP allow; the CoM
begins to move over the left foot while the waist sinks and the arm finds its brace.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.dynamics import inverse_dynamics
from humanoid_motion.motion import Motion, min_jerk, rest_to_rest, still
from humanoid_motion.pads import pad_contact
from humanoid_motion.robot_model import RobotModel, braced_upper_body
from humanoid_motion.whole_body import require_joint_limits, shares, solve, within_ranges
from humanoid_motion.zmp import margins
from scipy.optimize import least_squares

from impact_planner.hit.posture import RESERVE, braced
from impact_planner.hit.stance import (
    SINGLE_SUPPORT_MARGIN,
    HitStance,
    braced_over,
    com_x,
    initial_base,
)
from impact_planner.task.settings import PlannerSettings

# Start and end of the foot's horizontal travel as shares of the step's time. The foot rises before
# the travel and sinks after it.
_TRAVEL = (0.12, 0.88)
# Shares of the time of `prepare` and `shift` together in which the CoM stays in the middle, and
# after which the arm is braced and the waist as low as in the run-up: the end of `prepare`.
_STAYS, _BRACED = 0.4, 0.85
_MEETS = 0.8  # share of the time of `prepare` after which the arm goes along the pad's normal
_OFF_PAD = 0.005  # distance from the pad at which that begins [m]
_NEARNESS = 1e-5  # weight of the joints' distances from the braced posture [m/rad]
_NODES = 0.05  # time between solved postures, which a spline connects [s]
_FEWEST_SAMPLES = 8
_GUESS, _SHORTEST, _LONGER = 1.0, 0.6, 0.05  # first, shortest, and step between durations [s]
# Smallest planned margin of the ZMP on both feet and on one, as of HRP-2's sole [m].
_ON_BOTH, _ON_ONE = 0.03, 0.0275
_SPEED_RESERVE = 0.95  # share of the allowed speed of a joint that is used
_CANDIDATE_STEP = 0.0025  # between candidate places of the CoM, as of HRP-2's sole [m]


@dataclass(frozen=True)
class StandingPhase:
    """A phase whose supporting feet do not move.

    Attributes:
        name: Name of the phase.
        motion: Samples of the motion.
        feet: Places of the supporting soles in odom by side, (3,) each [m].
    """

    name: str
    motion: Motion
    feet: dict[str, Array]


def plan_approach(
    robot: RobotModel, stance: HitStance, y_run_up: float, settings: PlannerSettings
) -> list[StandingPhase]:
    """Plan the motion from half-sitting to the start of the run-up.

    Args:
        y_run_up: y of the CoM at the start of the run-up [m].

    Returns:
        The phases prepare, shift, step and back.

    Raises:
        PostureUnreachable: A leg does not reach its foot.
        JointLimit: The step exceeds the hips' range while the robot stands on its left foot.
    """
    start, placed = stance.feet_start, stance.feet
    over_left = _over_left_foot(robot, stance)

    def shortest(build: Callable[[float, float], Motion], feet: dict[str, Array]) -> Motion:
        return _shortest(robot, build, feet, settings)

    lowered = shortest(lambda duration, period: _prepare_and_shift(
        robot, stance, over_left, duration, period), start)
    braced_at = int(np.searchsorted(lowered.time, _BRACED * lowered.duration))
    left = {"left": start["left"]}
    step = shortest(lambda duration, period: _step(
        robot, stance, np.array([com_x(robot), over_left]), duration, period), left)
    back = shortest(lambda duration, period: _sway(
        robot, placed, stance.posture.waist_height, (over_left, y_run_up), duration, period),
        placed)
    return [
        StandingPhase("prepare", _part(lowered, 0, braced_at), start),
        StandingPhase("shift", _part(lowered, braced_at, len(lowered) - 1), start),
        StandingPhase("step", step, left),
        StandingPhase("back", back, placed),
    ]


def _shortest(
    robot: RobotModel, build: Callable[[float, float], Motion], feet: dict[str, Array],
    settings: PlannerSettings,
) -> Motion:
    """Make a motion as short as the joints' speeds and the margin of the ZMP allow.

    In s times the time, speeds are those of the guess over s, and the distance of the ZMP from the
    CoM is that over s^2. What does not become possible by more time is left to the later checks.

    Args:
        build: Makes the motion from its duration and sampling period [s].
        feet: The soles that bear load.
    """
    guess = build(_GUESS, _NODES)
    dynamics = inverse_dynamics(robot, guess)
    com, swing = dynamics.com[:, :2], dynamics.zmp - dynamics.com[:, :2]
    allowed = _SPEED_RESERVE * settings.limit_share
    longer = float(shares(guess.joint_speed, robot.speed_limit).max()) / allowed
    wanted = robot.config.sole_scale * (_ON_ONE if len(feet) == 1 else _ON_BOTH)
    wanted = min(wanted, float(margins(robot, com, feet, tuple(feet)).min()) - 1e-3)
    duration = max(_SHORTEST, longer * _GUESS)
    while margins(robot, com + swing * (_GUESS / duration) ** 2, feet, tuple(feet)).min() < wanted:
        duration += _LONGER
    return build(duration, settings.period)


def _part(motion: Motion, first: int, last: int) -> Motion:
    """Cut the samples from the first to the last out of a motion; their times begin at 0."""
    kept = {each.name: getattr(motion, each.name)[first : last + 1]
            for each in fields(motion) if getattr(motion, each.name) is not None}
    return replace(motion, **kept | {"time": kept["time"] - kept["time"][0]})


def sample_times(duration: float, period: float) -> Array:
    """Return evenly spaced times from 0 to a duration, at most a period apart, (N,) [s]."""
    samples = max(_FEWEST_SAMPLES, int(np.ceil(duration / period - 1e-9)) + 1)
    return np.linspace(0.0, duration, samples)


def _over_left_foot(robot: RobotModel, stance: HitStance) -> float:
    """Find y of the CoM during the step, as near to the left sole's middle as the hip allows [m].

    Raises:
        JointLimit: The hip roll allows no place with `SINGLE_SUPPORT_MARGIN`.
    """
    edges = robot.feet["left"].corners(stance.feet_start["left"])[:, 1]
    middle, inner = float(edges.mean()), float(edges.min())
    scale = robot.config.sole_scale
    candidates = np.arange(
        middle, inner + SINGLE_SUPPORT_MARGIN * scale - 1e-9, -_CANDIDATE_STEP * scale)
    height = stance.posture.waist_height
    joints, _ = braced_over(robot, candidates, height, stance.feet, strict=False)
    within = np.all(within_ranges(robot, joints, RESERVE), axis=1)
    if within.any():
        return float(candidates[np.argmax(within)])
    # No candidate is within range: these two raise the error that names leg or joint.
    joints, base = braced_over(robot, candidates[-1:], height, stance.feet)
    require_joint_limits(robot, still(joints[0], base[0]), "step", reserve=RESERVE)
    return float(candidates[-1])


def _prepare_and_shift(
    robot: RobotModel, stance: HitStance, over_left: float, duration: float, period: float
) -> Motion:
    """Move from half-sitting to the run-up's waist height and the brace, and over the left foot.

    The arm meets the pad of the trunk along the pad's normal, slowly: beside the pad's edge the
    ball would be pressed at once, and would jolt the elbow.

    Args:
        over_left: y of the CoM at the end [m].
    """
    time, ready = sample_times(duration, _NODES), _BRACED * duration
    part, meets = min_jerk(time, ready)[:, None], _MEETS * ready
    arm, onto = min_jerk(time, meets), min_jerk(time - meets, ready - meets)
    aside = min_jerk(time - _STAYS * duration, duration - _STAYS * duration)
    begin = initial_base(robot)
    relaxed, braced = robot.config.half_sitting, braced_upper_body(robot)
    before = _before_pad(robot, braced)
    com_xy = robot.com(robot.configuration(begin, relaxed))[:2]
    com_xy = com_xy + part * (np.array([com_x(robot), 0.0]) - com_xy)
    com_xy[:, 1] += aside * over_left
    joints, base = solve(
        robot,
        upper=(relaxed + arm[:, None] * (before - relaxed)
               + onto[:, None] * (braced - before)),
        com_xy=com_xy,
        waist_z=begin[2] + part[:, 0] * (stance.posture.waist_height - begin[2]),
        feet=stance.feet_start,
    )
    return rest_to_rest(time, joints, base, sample_times(duration, period))


def _before_pad(robot: RobotModel, braced: Array) -> Array:
    """Find the joints whose arm is off the trunk's pad by `_OFF_PAD` along its normal, (J,) [rad].

    They are the nearest to the braced joints; without a brace they are those.
    """
    brace = robot.config.brace
    if brace is None:
        return braced
    columns, joints = robot.arm_columns, braced.copy()

    def offset(moved: Array) -> Array:
        joints[columns] = braced[columns] + moved
        q = robot.configuration(np.zeros(3), joints)
        return pad_contact(robot, q, brace).offset

    wanted = offset(np.zeros(len(columns))) + np.array([_OFF_PAD, 0.0, 0.0])
    offset(least_squares(
        lambda moved: np.concatenate([offset(moved) - wanted, _NEARNESS * moved]),
        np.zeros(len(columns))).x)
    return joints


def _sway(
    robot: RobotModel,
    feet: dict[str, Array],
    height: float,
    y: tuple[float, float],
    duration: float,
    period: float,
) -> Motion:
    """Move the CoM along y between two places [m], at a constant height of the waist [m]."""
    time = sample_times(duration, _NODES)
    course = y[0] + min_jerk(time, duration) * (y[1] - y[0])
    joints, base = braced_over(robot, course, height, feet)
    return rest_to_rest(time, joints, base, sample_times(duration, period))


def _step(
    robot: RobotModel, stance: HitStance, com: Array, duration: float, period: float
) -> Motion:
    """Move the right foot while the CoM rests over the left sole at `com`, (2,) [m]."""
    time = sample_times(duration, _NODES)
    u = time / duration
    travel = min_jerk((u - _TRAVEL[0]) / (_TRAVEL[1] - _TRAVEL[0]), 1.0)[:, None]
    begin, end = stance.feet_start["right"], stance.feet["right"]
    right = begin + travel * (end - begin)
    right[:, 2] += robot.config.step.lift * (4.0 * u * (1.0 - u)) ** 3
    joints, base = braced(
        robot, np.tile(com, (len(time), 1)), stance.posture.waist_height,
        {"left": stance.feet_start["left"], "right": right})
    return rest_to_rest(time, joints, base, sample_times(duration, period))
