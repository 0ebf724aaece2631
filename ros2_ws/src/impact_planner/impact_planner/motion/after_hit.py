"""Motion after the hit, section II.B: from v'_rB to rest, also for a door that stands elsewhere.

The robot continues along the run-up's postures from the reduced speed. The door must leave the
robot (constraint 4 of section II.B); otherwise w' would not be that of eqs. (2) to (4). This module
also plans for doors that stand nearer or farther than reported, for a missed contact, and for the
retreat of the paper's experiment.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.knots import Knots
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.motion import Motion, min_jerk_course

from impact_planner.errors import SpeedUnreachable
from impact_planner.motion.approach import sample_times
from impact_planner.motion.missed import missed_margin
from impact_planner.motion.phase_plan import Branches
from impact_planner.motion.post import knots_to_rest, path_time, slowing_times
from impact_planner.motion.run_up import HitDesign, course_of_com
from impact_planner.task.request import Task
from impact_planner.task.settings import PlannerSettings

_REST_SHARES = (1.0, 1.25, 1.5, 0.75, 0.5)  # shares of the time to rest, tried in this order
# Shares of the nominal door's time to rest, tried for a door that stands elsewhere.
_BRANCH_SHARES = (1.0, 0.75, 0.5)
_TRIALS = 60  # number of samples of a candidate motion to rest
_STOP_TIMES = (0.4, 0.5, 0.6)  # candidate durations of a stop of the run-up [s]
_STOPS = 50  # number of candidate starts of a stop
_STOP_SAMPLES = 30  # number of samples of a candidate stop
_PUSHED = 5e-4  # largest distance by which the robot may push the door after the hit [m]


@dataclass(frozen=True)
class AfterHit:
    """The phase `post`, which begins at the switch.

    Attributes:
        motion: Samples from the end of `slow_down`, when the door no longer pushes back.
        knots: Knots of the whole phase, from the switch.
        rest: Time from the end of `slow_down` to rest [s].
    """

    motion: Motion
    knots: Knots
    rest: float


def plan_after_hit(task: Task, hit: HitDesign) -> AfterHit:
    """Plan the motion from the switch to the door's peak, along the run-up's postures to rest.

    Raises:
        PostureUnreachable: The legs do not reach far enough to come to rest, or the ZMP would come
            too near to the soles' edge.
    """
    settings, slow = task.settings, task.settings.slow_down
    start = hit.run_up.contact_time + settings.switch_delay
    tried: list[tuple[float, int, float]] = []  # margin, the first one of equal ones, rest
    for share in _REST_SHARES:
        rest = share * settings.post_duration
        tried.append((_margin(hit, slow, start, rest), -len(tried), rest))
        if tried[-1][0] >= settings.required_margin:
            break
    margin, _, rest = max(tried)
    if margin < settings.required_margin:
        shortest = min(_REST_SHARES) * settings.post_duration
        raise _no_rest(settings, hit, start, shortest, margin)
    total = max(hit.prediction.peak_time - settings.switch_delay, slow + rest)
    time, after = slowing_times(rest, slow), sample_times(total - slow, settings.period)
    whole = hit.run_up.table.motion(time, *_course(hit, time, start, rest, slow))
    knots = knots_to_rest(
        time, whole.joints, whole.joint_speed, whole.joint_acceleration, slow)
    if total > float(time[-1]) + 1e-9:
        knots = knots.held_until(total)
    late = _course(hit, slow + after, start, rest, slow)
    return AfterHit(hit.run_up.table.motion(slow + after, *late), knots, rest)


def _no_rest(
    settings: PlannerSettings, hit: HitDesign, start: float, rest: float, margin: float,
    where: str = "",
) -> PostureUnreachable:
    """Make the error of a robot that does not come to rest after the switch.

    Args:
        start: Path time at the switch [s].
        rest: Shortest allowed time to rest [s].
        margin: Best ZMP margin [m]; -inf where the legs do not reach far enough.
        where: Words for the message that name the door where it is not the nominal one.
    """
    table, speed = hit.run_up.table, hit.transfer.speeds.v_rb_post
    begin = f"post: from v'_rB = {speed:.3f} m/s{where}, the robot"
    if not math.isfinite(margin):
        distance = table.y_hit - float(_to_rest(hit, settings.slow_down, start, rest)[0].min())
        reach = table.y_hit - table.low
        return PostureUnreachable(
            f"{begin} cannot come to rest before it is {1e3 * distance:.0f} mm past the nominal "
            f"contact, but the legs reach only {1e3 * reach:.0f} mm; request a smaller angle",
            quantity="way to rest [m]", value=distance, limit=reach, phase="post")
    return PostureUnreachable(
        f"{begin} does not come to rest safely: the ZMP would come to {1e3 * margin:.1f} mm from "
        f"the edge of the soles, {1e3 * settings.required_margin:.1f} mm are required; request a "
        "smaller angle",
        quantity="ZMP margin [m]", value=margin, limit=settings.required_margin, phase="post")


def _course(
    hit: HitDesign, time: Array, start: float | Array, rest: float, slow: float,
    ratio: float | None = None,
) -> tuple[Array, Array, Array]:
    """Compute place [m], speed [m/s] and acceleration [m/s^2] of the CoM along y.

    Arguments and shapes are as for `path_time`; the ratio of the hit's speeds is the default.
    """
    ratio = hit.transfer.speeds.ratio if ratio is None else ratio
    return course_of_com(
        hit.run_up.law, hit.run_up.y_start, *path_time(time, start, ratio, rest, slow))


def _to_rest(
    hit: HitDesign, slow: float, start: float, rest: float
) -> tuple[Array, Array, Array]:
    """Compute `_course` at `_TRIALS` samples from the end of `slow_down` to rest."""
    return _course(hit, slow + np.linspace(0.0, rest, _TRIALS), start, rest, slow)


def _margin(hit: HitDesign, slow: float, start: float, rest: float) -> float:
    """Compute the ZMP margin after a switch at path time `start` [m]; -inf out of reach."""
    table, course = hit.run_up.table, _to_rest(hit, slow, start, rest)
    return -math.inf if course[0].min() < table.low - 1e-9 else float(table.margin(*course))


def plan_branches(task: Task, hit: HitDesign, rest: float) -> Branches:
    """Compute margins for a door that stands nearer or farther, and for a missed contact.

    Args:
        rest: Time from the end of `slow_down` to rest [s].

    Raises:
        PostureUnreachable: With a door that stands nearer or farther by `door_uncertainty`, the
            robot does not come to rest with the required ZMP margin.
    """
    run_up, settings = hit.run_up, task.settings
    nominal = run_up.contact_time + settings.switch_delay
    offset = settings.door_uncertainty / run_up.law.speed
    found = {}
    for name, start in (("nearer", nominal - offset), ("farther", nominal + offset)):
        margin = max(
            _margin(hit, settings.slow_down, start, share * rest) for share in _BRANCH_SHARES)
        if margin < settings.required_margin:
            where = f" at a door {1e3 * settings.door_uncertainty:.0f} mm {name}"
            raise _no_rest(settings, hit, start, min(_BRANCH_SHARES) * rest, margin, where)
        found[name] = margin
    stop_duration, no_return = _latest_stop(task, hit)
    return Branches(found["nearer"], found["farther"], no_return, stop_duration,
                    missed_margin(hit.stance, run_up), rest)


def _latest_stop(task: Task, hit: HitDesign) -> tuple[float, float]:
    """Find the latest safe stop of the run-up.

    A stop continues along the run-up's postures while the rate of its time falls to zero.

    Returns:
        Duration of the stop [s], and the point of no return as time before the nominal contact
        [s]. A stop begun later would take the ZMP nearer to the soles' edge, or B nearer to the
        leaf, than allowed.
    """
    run_up, table = hit.run_up, hit.run_up.table
    clear = run_up.law.distance - task.robot.config.clearance / table.waist_per_com(table.y_hit)
    begins = np.linspace(0.0, run_up.contact_time, _STOPS)
    best = (_STOP_TIMES[0], 0.0)
    for duration in _STOP_TIMES:
        time = np.linspace(0.0, duration, _STOP_SAMPLES)
        course = _course(hit, time, begins[:, None], duration, 0.0, ratio=1.0)
        good = table.margin(*course) >= task.settings.required_margin
        good &= run_up.y_start - course[0][:, -1] <= clear
        last = int(np.argmin(np.append(good, False))) - 1
        if last >= 0 and begins[last] >= best[1]:
            best = duration, float(begins[last])
    return best[0], run_up.contact_time - best[1]


def require_leaving(task: Task, hit: HitDesign, post: Motion) -> None:
    """Check that the door leaves the robot after the hit (constraint 4 of section II.B).

    Args:
        post: Motion from the end of `slow_down`.

    Raises:
        SpeedUnreachable: The robot would follow the door and keep pushing it, so that w' would
            not be that of eqs. (2) to (4).
    """
    angle = hit.prediction.angle_at(post.time + task.settings.switch_delay)
    elbow = hit.stance.posture.elbow + post.base - hit.stance.posture.base
    gap = LeafFrame(hit.placement.hinge, angle).gap(elbow)
    pushed = float(gap[0] - gap.min())
    if pushed > _PUSHED:
        raise SpeedUnreachable(
            f"the door would not leave the robot: at v'_rB = "
            f"{hit.transfer.speeds.v_rb_post:.3f} m/s after the hit the robot would push it "
            f"another {1e3 * pushed:.1f} mm, {1e3 * _PUSHED:.1f} mm are allowed; request another "
            "angle",
            quantity="pushed on [m]", value=pushed, limit=_PUSHED, phase="post")


def retreat_motion(hit: HitDesign, y_end: float, duration: float, period: float) -> Motion:
    """Make the motion back to the start of the run-up with minimum jerk (Fig. 12 (f)).

    Args:
        y_end: y of the CoM at the end of `post` [m].
        duration: Duration of the retreat [s].
        period: Sampling period [s].
    """
    time = sample_times(duration, period)
    distance = hit.run_up.y_start - y_end
    part, speed, acceleration = min_jerk_course(time, duration)
    return hit.run_up.table.motion(
        time, y_end + distance * part, distance * speed, distance * acceleration)
