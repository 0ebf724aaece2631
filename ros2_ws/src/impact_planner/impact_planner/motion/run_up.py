"""The run-up, section II.C.4: the CoM moves to the door until B has the speed v_rB.

Its time law is the first half of MCV50 (Fig. 6, `cam_curve`), or the course with the largest ZMP
margin (`zmp_run_up`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import Dynamics, inverse_dynamics
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.motion import Motion
from humanoid_motion.zmp import margins
from scipy.optimize import brentq, minimize_scalar

from impact_planner.errors import InvalidRequest, SpeedUnreachable
from impact_planner.hit.stance import HitStance
from impact_planner.hit.transfer import Blow
from impact_planner.motion.cam_curve import CamRunUp
from impact_planner.motion.post import path_time
from impact_planner.motion.posture_table import PostureTable
from impact_planner.motion.zmp_run_up import Floor, SmoothRunUp, best_run_up, fastest_run_up
from impact_planner.task.request import Task

Law = CamRunUp | SmoothRunUp

_SLOWEST = 0.05  # smallest speed of B that is planned for [m/s]
_SHORTEST = 0.05  # smallest distance of a run-up, as of HRP-2's sole [m]
# Largest tabulated distance past the hit, for a late contact and for the motion after the hit [m].
_REACH = 0.1
_SEARCH_SAMPLES = 100  # number of samples of the ZMP of a candidate run-up
# Distance that the overrun leaves for this stop, unless `door_uncertainty` needs it, as of HRP-2's
# sole [m].
_STOP_DISTANCE = 0.02
_OVERRUN_SAMPLES = 33  # number of places at which the overrun's joint speeds are checked
_NEARER = 1e-6  # margin that a start may cost for being nearer to the left foot [m/m]


@dataclass(frozen=True)
class RunUpPlan:
    """A run-up that keeps the required ZMP margin.

    Attributes:
        table: Postures of the run-up.
        y_start: y of the CoM at the start in odom [m].
        overrun: Distance at constant speed past the nominal contact, for a late contact [m].
        law: Time law of the CoM.
        motion: Samples from the start to rest past the overrun, where no contact happens.
        dynamics: Floor forces and ZMP at the samples.
        margin: Smallest distance of the ZMP to the edge of the support polygon [m].
    """

    table: PostureTable
    y_start: float
    overrun: float
    law: Law
    motion: Motion
    dynamics: Dynamics
    margin: float

    @property
    def contact_time(self) -> float:
        """Time from the start to the nominal contact [s]."""
        return self.law.duration


@dataclass(frozen=True)
class HitDesign(Blow):
    """All decisions about a hit: the blow, and the run-up that brings B to its speed, II.C.4."""

    run_up: RunUpPlan


def plan_run_up(task: Task, stance: HitStance, v_rb: float) -> RunUpPlan:
    """Plan the run-up that brings point B to its speed along -y at the contact [m/s].

    Raises:
        InvalidRequest: y_start leaves too short a distance to the hit.
        SpeedUnreachable: The ZMP would come nearer to the soles' edge than allowed, or the hit is
            too slow to plan. Value and limit are v_rb and the speed of B that can be reached [m/s].
        PostureUnreachable: The legs reach no start of a run-up.
        JointLimit: The legs are too short or too slow for `door_uncertainty` past the contact.
    """
    _require_room_and_speed(task, v_rb, float(stance.posture.com[1]))
    return time_run_up(task, stance, PostureTable(task.robot, stance, _REACH), v_rb)


def time_run_up(task: Task, stance: HitStance, table: PostureTable, v_rb: float) -> RunUpPlan:
    """Choose the time law of a run-up along tabulated postures; as for `plan_run_up`."""
    speed = v_rb / table.waist_per_com(table.y_hit)
    chosen = _best(task, table, speed)
    if chosen is None or chosen.margin < task.settings.required_margin:
        raise _too_fast(task, table, v_rb, chosen)
    return _timed(task, stance, table, chosen, usable_overrun(task, table, speed))


def usable_overrun(task: Task, table: PostureTable, speed: float) -> float:
    """Compute how far the run-up can continue past the contact at full speed [m].

    It is at most `overrun`. The rest of the legs' reach is for the stop after a missed contact.
    Towards the end of the reach the left leg is nearly stretched, which makes its knee fast.

    Args:
        speed: Speed of the CoM [m/s].

    Raises:
        JointLimit: Not even `door_uncertainty` keeps the joints' limits.
    """
    robot, share, steady = task.robot, task.settings.limit_share, task.settings.door_uncertainty
    reach = table.y_hit - table.low
    stop = _STOP_DISTANCE * robot.config.sole_scale
    longest = min(task.settings.overrun, reach, max(steady, reach - stop))
    distance = np.linspace(0.0, longest, _OVERRUN_SAMPLES)
    ratio = speed * np.abs(table.joint_slopes(table.y_hit - distance)) / robot.speed_limit
    over = np.flatnonzero((ratio > share).any(axis=1))
    kept = int(over[0]) if over.size else len(distance)  # number of places within the limits
    granted = float(distance[kept - 1]) if kept else 0.0
    if granted >= steady - 1e-9:
        return granted
    if not over.size:
        raise JointLimit(
            f"cam: the legs reach {1e3 * longest:.0f} mm past the nominal contact, but a door that "
            f"stands farther needs {1e3 * steady:.0f} mm; reduce door_uncertainty or request a "
            "smaller angle",
            phase="cam", quantity="overrun [m]", value=longest, limit=steady)
    at = int(np.searchsorted(distance, min(steady, longest)))
    joint = int(np.argmax(ratio[at]))
    name, limit = robot.joint_names[joint], share * float(robot.speed_limit[joint])
    value = float(ratio[at, joint] * robot.speed_limit[joint])
    raise JointLimit(
        f"cam: {name} would turn at {value:.2f} rad/s {1e3 * distance[at]:.0f} mm past the nominal "
        f"contact, {limit:.2f} rad/s are allowed ({100.0 * share:.0f} % of its limit); request a "
        "smaller angle",
        joint=name, phase="cam", quantity="speed [rad/s]", value=value, limit=limit)


def _require_room_and_speed(task: Task, v_rb: float, y_hit: float) -> None:
    """Check that the start leaves enough distance, and that the hit is fast enough to plan."""
    nearest, y_start = y_hit + _shortest(task), task.settings.y_start
    if y_start is not None and y_start < nearest:
        raise InvalidRequest(
            f"y_start is {y_start:.3f} m, but the hit at y = {y_hit:.3f} m needs a start at "
            f"{nearest:.3f} m or more",
            quantity="y_start [m]", value=y_start, limit=nearest, phase="cam")
    if v_rb < _SLOWEST:
        raise SpeedUnreachable(
            f"a hit at v_rB = {v_rb:.2g} m/s is too slow to plan, the least is {_SLOWEST} m/s; "
            "request a larger angle",
            quantity="v_rb [m/s]", value=v_rb, limit=_SLOWEST, phase="cam")


def _shortest(task: Task) -> float:
    return _SHORTEST * task.robot.config.sole_scale


@dataclass(frozen=True)
class _Candidate:
    """A candidate for the run-up.

    Attributes:
        law: Time law of the CoM.
        y_start: y of the CoM at the start [m].
        margin: Smallest distance of the ZMP from the soles' edges along y [m].
    """

    law: Law
    y_start: float
    margin: float


def _best(task: Task, table: PostureTable, speed: float) -> _Candidate | None:
    """Find the run-up of the wished kind with the largest margin at a speed of the CoM [m/s]."""
    if task.wanted.run_up == "zmp_limited":
        found = best_run_up(_floor(task, table), speed)
        return None if found is None else _Candidate(*found)
    return _mcv50(task, table, speed)


def _floor(task: Task, table: PostureTable) -> Floor:
    """Describe where the run-up `zmp_limited` may lead."""
    return Floor(table.zmp, table.edges, table.y_hit, _highest(task, table),
                 task.settings.door_uncertainty)


def _highest(task: Task, table: PostureTable) -> float:
    """Return the largest y at which the run-up may start [m]."""
    wished = task.settings.y_start
    return table.high if wished is None else min(wished, table.high)


def _mcv50(task: Task, table: PostureTable, speed: float) -> _Candidate:
    """Choose MCV50 from the wished start, or from the start with the largest margin."""

    def candidate(y0: float) -> _Candidate:
        law = CamRunUp(speed=speed, distance=y0 - table.y_hit)
        time = np.linspace(0.0, law.duration, _SEARCH_SAMPLES)
        return _Candidate(law, y0, float(table.margin(*course_of_com(law, y0, time))))

    if task.settings.y_start is not None:
        return candidate(_highest(task, table))
    nearest = table.y_hit + _shortest(task)
    if table.high <= nearest:
        raise PostureUnreachable(
            f"the run-up must start at y = {nearest:.3f} m or more, but the legs and run_up_start "
            f"allow {table.high:.3f} m at most",
            quantity="y_start [m]", value=table.high, limit=nearest, phase="cam")
    # Where the end of the run-up decides the margin, many starts have the same margin but for
    # rounding. The slight slope prefers the start that is nearest to the left foot.
    result = minimize_scalar(
        lambda y0: -candidate(y0).margin - _NEARER * y0,
        bounds=(nearest, table.high),
        method="bounded",
        options={"xatol": 5e-4},
    )
    return candidate(float(result.x))


def course_of_com(
    law: Law, y_start: float, time: Array, rate: float | Array = 1.0, slope: float | Array = 0.0
) -> tuple[Array, Array, Array]:
    """Compute place [m], speed [m/s] and acceleration [m/s^2] of the CoM along y in a run-up.

    Args:
        y_start: y of the CoM at the start [m].
        time: Path times, that is times of the law, of any shape [s].
        rate: Rate of the path time.
        slope: Derivative of this rate by time [1/s].
    """
    course = law.at(time)
    return y_start - course.s, -course.v * rate, -course.a * rate**2 - course.v * slope


def _timed(
    task: Task, stance: HitStance, table: PostureTable, chosen: _Candidate, overrun: float
) -> RunUpPlan:
    """Sample the chosen run-up, including the stop past the overrun, with dynamics and margin."""
    law, period, stop = chosen.law, task.settings.period, task.settings.missed_stop
    end = law.duration + overrun / law.speed
    time = np.append(np.arange(0.0, end - 0.25 * period, period), end)
    time = np.union1d(time, [law.duration])
    time = time[np.append(True, np.diff(time) > 1e-6)]
    # The distance to rest of `path_time` is half of its duration times the speed.
    stop = min(stop, 2.0 * (table.y_hit - table.low - overrun) / law.speed)
    if stop > 0.0:
        time = np.append(time, end + np.linspace(0.0, stop, math.ceil(stop / period) + 1)[1:])
    late = np.maximum(time - end, 0.0)
    ahead, rate, slope = path_time(late, end, 1.0, stop or period)
    motion = table.motion(time, *course_of_com(
        law, chosen.y_start, np.where(late > 0.0, ahead, time), rate, slope))
    dynamics = inverse_dynamics(task.robot, motion)
    # The motion past the contact is only a reserve, so the ZMP is checked up to the contact.
    counted = time <= law.duration + 0.5 * period
    margin = margins(task.robot, dynamics.zmp[counted], stance.feet, SIDES)
    return RunUpPlan(
        table, chosen.y_start, overrun, law, motion, dynamics, float(np.min(margin)))


def _too_fast(
    task: Task, table: PostureTable, v_rb: float, chosen: _Candidate | None
) -> SpeedUnreachable:
    """Make the error of a run-up that is too fast, with the speed of B that can be reached."""
    kind, per_com = task.wanted.run_up, table.waist_per_com(table.y_hit)
    reached = _fastest(task, table, v_rb / per_com) * per_com
    reason = "no course of the CoM reaches it" if chosen is None else (
        f"the ZMP would come to {1e3 * chosen.margin:.1f} mm from the edge of the soles, "
        f"{1e3 * task.settings.required_margin:.1f} mm are required")
    other = " or the run-up zmp_limited, which reaches more" if kind == "mcv50" else ""
    return SpeedUnreachable(
        f"a hit at v_rB = {v_rb:.3f} m/s is too fast: {reason}; {kind} reaches "
        f"v_rB = {reached:.3f} m/s, so request a smaller angle{other}",
        quantity="v_rb [m/s]", value=v_rb, limit=reached, phase="cam")


def _fastest(task: Task, table: PostureTable, too_fast: float) -> float:
    """Find the largest speed of the CoM with the required margin [m/s]; 0 where none has it."""
    required = task.settings.required_margin
    if task.wanted.run_up == "zmp_limited":
        return fastest_run_up(_floor(task, table), required, too_fast)

    def reserve(speed: float) -> float:
        return _mcv50(task, table, speed).margin - required

    slow = 1e-3
    return 0.0 if reserve(slow) < 0.0 else float(brentq(reserve, slow, too_fast, xtol=1e-4))
