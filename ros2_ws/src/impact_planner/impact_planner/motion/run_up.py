"""The run-up, section II.C.4: the CoM moves to the door until B has the speed v_rB.

Its time law is the first half of MCV50 (Fig. 6, `cam_curve`), or the course with the largest ZMP
margin (`zmp_run_up`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import Dynamics, inverse_dynamics
from humanoid_motion.errors import JointLimit
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.zmp import edge_margin, margins
from scipy.optimize import brentq, minimize_scalar

from impact_planner.errors import InvalidRequest, SpeedUnreachable
from impact_planner.hit.stance import HitStance, sole_edges
from impact_planner.motion.cam_curve import CamRunUp
from impact_planner.motion.post import path_time
from impact_planner.motion.posture_table import PostureTable
from impact_planner.motion.zmp_run_up import SmoothRunUp, best_run_up, fastest_run_up

Law = CamRunUp | SmoothRunUp

_SLOWEST = 0.05  # smallest speed of B that is planned for [m/s]
_SHORTEST = 0.05  # smallest distance of a run-up [m]
# Largest tabulated distance past the hit, for a late contact and for the motion after the hit [m].
_REACH = 0.1
_SEARCH_SAMPLES = 100  # number of samples of the ZMP of a candidate run-up
# Distance that the overrun leaves for this stop, unless `RunUpWish.steady` needs it [m].
_STOP_DISTANCE = 0.02
_OVERRUN_SAMPLES = 33  # number of places at which the overrun's joint speeds are checked
_NEARER = 1e-6  # margin that a start may cost for being nearer to the left foot [m/m]


@dataclass(frozen=True)
class RunUpWish:
    """Requirements on a run-up.

    Attributes:
        kind: Time law: ``mcv50``, which is the paper's, or ``zmp_limited``.
        v_rb: Speed of point B along y before the hit [m/s].
        steady: Smallest distance at constant speed before and past the nominal contact, for a
            door that stands nearer or farther [m].
        overrun: Desired distance at constant speed past the nominal contact [m].
        required_margin: Smallest allowed ZMP margin [m].
        joint_share: Share of the joints' speed limits that may be used.
        period: Sampling period [s].
        y_start: y of the CoM at the start of MCV50 [m]; None chooses the start with the largest
            ZMP margin.
        stop: Longest stop after a missed contact [s].
    """

    kind: str
    v_rb: float
    steady: float
    overrun: float
    required_margin: float
    joint_share: float
    period: float
    y_start: float | None = None
    stop: float = 0.3


@dataclass(frozen=True)
class RunUpPlan:
    """A run-up that keeps the required ZMP margin.

    Attributes:
        table: Postures of the run-up.
        y_start: y of the CoM at the start in odom [m].
        y_hit: y of the CoM at the nominal contact in odom [m].
        overrun: Distance at constant speed past the nominal contact, for a late contact [m].
        law: Time law of the CoM.
        motion: Samples from the start to rest past the overrun, where no contact happens.
        dynamics: Floor forces and ZMP at the samples.
        margin: Smallest distance of the ZMP to the edge of the support polygon [m].
    """

    table: PostureTable
    y_start: float
    y_hit: float
    overrun: float
    law: Law
    motion: Motion
    dynamics: Dynamics
    margin: float

    @property
    def contact_time(self) -> float:
        """Time from the start to the nominal contact [s]."""
        return self.law.duration


def plan_run_up(robot: RobotModel, stance: HitStance, wish: RunUpWish) -> RunUpPlan:
    """Plan the run-up that brings point B to its speed at the contact.

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        wish: Requirements on the run-up.

    Raises:
        InvalidRequest: y_start leaves too short a distance to the hit.
        SpeedUnreachable: The ZMP would come nearer to the soles' edge than allowed, or the hit is
            too slow to plan. Value and limit are v_rb and the speed of B that can be reached [m/s].
        PostureUnreachable: The legs reach no start of a run-up.
        JointLimit: The legs are too short or too slow for `wish.steady` past the contact.
    """
    _require_room_and_speed(wish, float(stance.posture.com[1]))
    return time_run_up(robot, stance, PostureTable(robot, stance, _REACH), wish)


def time_run_up(
    robot: RobotModel, stance: HitStance, table: PostureTable, wish: RunUpWish
) -> RunUpPlan:
    """Choose the time law of a run-up along tabulated postures.

    Arguments and errors are as for `plan_run_up`.
    """
    edges = sole_edges(robot, stance.feet)
    speed = wish.v_rb / table.waist_per_com(table.y_hit)
    chosen = _best(table, edges, wish, speed)
    if chosen is None or chosen.margin < wish.required_margin:
        raise _too_fast(table, edges, wish, chosen)
    overrun = usable_overrun(robot, table, speed, wish)
    return _timed(robot, stance, table, chosen, overrun, wish)


def usable_overrun(
    robot: RobotModel, table: PostureTable, speed: float, wish: RunUpWish
) -> float:
    """Distance that the run-up can continue past the contact at full speed, at most as wished [m].

    The rest of the legs' reach is for the stop after a missed contact. Towards the end of the
    reach the left leg is nearly stretched, which makes its knee fast.

    Args:
        robot: The robot.
        table: Postures of the run-up.
        speed: Speed of the CoM [m/s].
        wish: Requirements on the run-up.

    Raises:
        JointLimit: Not even `wish.steady` keeps the joints' limits.
    """
    reach = table.y_hit - table.low
    longest = min(wish.overrun, reach, max(wish.steady, reach - _STOP_DISTANCE))
    distance = np.linspace(0.0, longest, _OVERRUN_SAMPLES)
    ratio = speed * np.abs(table.joint_slopes(table.y_hit - distance)) / robot.speed_limit
    over = np.flatnonzero((ratio > wish.joint_share).any(axis=1))
    kept = int(over[0]) if over.size else len(distance)  # number of places within the limits
    granted = float(distance[kept - 1]) if kept else 0.0
    if granted >= wish.steady - 1e-9:
        return granted
    if not over.size:
        raise JointLimit(
            f"cam: the legs reach {1e3 * longest:.0f} mm past the nominal contact, but a door that "
            f"stands farther needs {1e3 * wish.steady:.0f} mm; reduce door_uncertainty or request "
            "a smaller angle",
            phase="cam", quantity="overrun [m]", value=longest, limit=wish.steady)
    at = int(np.searchsorted(distance, min(wish.steady, longest)))
    joint = int(np.argmax(ratio[at]))
    name, limit = robot.joint_names[joint], wish.joint_share * float(robot.speed_limit[joint])
    value = float(ratio[at, joint] * robot.speed_limit[joint])
    raise JointLimit(
        f"cam: {name} would turn at {value:.2f} rad/s {1e3 * distance[at]:.0f} mm past the nominal "
        f"contact, {limit:.2f} rad/s are allowed ({100.0 * wish.joint_share:.0f} % of its limit); "
        "request a smaller angle",
        joint=name, phase="cam", quantity="speed [rad/s]", value=value, limit=limit)


def _require_room_and_speed(wish: RunUpWish, y_hit: float) -> None:
    """Check that the start leaves enough distance, and that the hit is fast enough to plan.

    Raises:
        InvalidRequest: The start is too near to the hit.
        SpeedUnreachable: The hit is too slow.
    """
    if wish.y_start is not None and wish.y_start < y_hit + _SHORTEST:
        raise InvalidRequest(
            f"y_start is {wish.y_start:.3f} m, but the hit at y = {y_hit:.3f} m needs a start at "
            f"{y_hit + _SHORTEST:.3f} m or more",
            quantity="y_start [m]",
            value=wish.y_start,
            limit=y_hit + _SHORTEST,
            phase="cam",
        )
    if wish.v_rb < _SLOWEST:
        raise SpeedUnreachable(
            f"a hit at v_rB = {wish.v_rb:.2g} m/s is too slow to plan, the least is {_SLOWEST} "
            "m/s; request a larger angle",
            quantity="v_rb [m/s]",
            value=wish.v_rb,
            limit=_SLOWEST,
            phase="cam",
        )


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


def _best(
    table: PostureTable, edges: tuple[float, float], wish: RunUpWish, speed: float
) -> _Candidate | None:
    """The run-up of the wished kind with the largest margin at a speed of the CoM [m/s]."""
    if wish.kind == "zmp_limited":
        found = best_run_up(
            table.zmp, edges, speed=speed, y_hit=table.y_hit, highest=_highest(table, wish),
            steady=wish.steady)
        return None if found is None else _Candidate(*found)
    return _mcv50(table, edges, speed, wish)


def _highest(table: PostureTable, wish: RunUpWish) -> float:
    """Largest y at which the run-up may start [m]."""
    return table.high if wish.y_start is None else min(wish.y_start, table.high)


def _mcv50(
    table: PostureTable, edges: tuple[float, float], speed: float, wish: RunUpWish
) -> _Candidate:
    """MCV50 from the wished start, or from the start with the largest margin."""

    def candidate(y0: float) -> _Candidate:
        law = CamRunUp(speed=speed, distance=y0 - table.y_hit)
        course = law.at(np.linspace(0.0, law.duration, _SEARCH_SAMPLES))
        zmp = table.zmp(y0 - course.s, -course.v, -course.a)
        return _Candidate(law, y0, float(edge_margin(zmp, edges)))

    if wish.y_start is not None:
        return candidate(_highest(table, wish))
    # Where the end of the run-up decides the margin, many starts have the same margin but for
    # rounding. The slight slope prefers the start that is nearest to the left foot.
    result = minimize_scalar(
        lambda y0: -candidate(y0).margin - _NEARER * y0,
        bounds=(table.y_hit + _SHORTEST, table.high),
        method="bounded",
        options={"xatol": 5e-4},
    )
    return candidate(float(result.x))


def _timed(
    robot: RobotModel,
    stance: HitStance,
    table: PostureTable,
    chosen: _Candidate,
    overrun: float,
    wish: RunUpWish,
) -> RunUpPlan:
    """The chosen run-up with samples, dynamics and margin, including the stop past the overrun."""
    law, y0, period = chosen.law, chosen.y_start, wish.period
    end = law.duration + overrun / law.speed
    time = np.append(np.arange(0.0, end - 0.25 * period, period), end)
    time = np.union1d(time, [law.duration])
    time = time[np.append(True, np.diff(time) > 1e-6)]
    # The distance to rest of `path_time` is half of its duration times the speed.
    reach = 2.0 * (table.y_hit - table.low - overrun) / law.speed
    stop = min(wish.stop, reach)
    if stop > 0.0:
        time = np.append(time, end + np.linspace(0.0, stop, math.ceil(stop / period) + 1)[1:])
    late = np.maximum(time - end, 0.0)
    ahead, rate, slope = path_time(late, end, 1.0, stop or period)
    course = law.at(np.where(late > 0.0, ahead, time))
    rate, slope = (np.where(late > 0.0, one, plain) for one, plain in ((rate, 1.0), (slope, 0.0)))
    motion = table.motion(
        time, y0 - course.s, -course.v * rate, -course.a * rate**2 - course.v * slope)
    dynamics = inverse_dynamics(robot, motion)
    # The motion past the contact is only a reserve, so the ZMP is checked up to the contact.
    counted = time <= law.duration + 0.5 * period
    margin = margins(robot, dynamics.zmp[counted], stance.feet, SIDES)
    return RunUpPlan(
        table, y0, table.y_hit, overrun, law, motion, dynamics, float(np.min(margin)))


def _too_fast(
    table: PostureTable, edges: tuple[float, float], wish: RunUpWish, chosen: _Candidate | None
) -> SpeedUnreachable:
    """The error of a run-up that is too fast, with the speed of B that can be reached."""
    reached = _fastest(table, edges, wish) * table.waist_per_com(table.y_hit)
    reason = "no course of the CoM reaches it" if chosen is None else (
        f"the ZMP would come to {1e3 * chosen.margin:.1f} mm from the edge of the soles, "
        f"{1e3 * wish.required_margin:.1f} mm are required")
    other = " or the run-up zmp_limited, which reaches more" if wish.kind == "mcv50" else ""
    return SpeedUnreachable(
        f"a hit at v_rB = {wish.v_rb:.3f} m/s is too fast: {reason}; {wish.kind} reaches "
        f"v_rB = {reached:.3f} m/s, so request a smaller angle{other}",
        quantity="v_rb [m/s]",
        value=wish.v_rb,
        limit=reached,
        phase="cam",
    )


def _fastest(table: PostureTable, edges: tuple[float, float], wish: RunUpWish) -> float:
    """Largest speed of the CoM with the required margin [m/s]; 0 where no speed has it."""
    too_fast = wish.v_rb / table.waist_per_com(table.y_hit)
    if wish.kind == "zmp_limited":
        return fastest_run_up(
            table.zmp, edges, margin=wish.required_margin, most=too_fast, y_hit=table.y_hit,
            highest=_highest(table, wish), steady=wish.steady)

    def reserve(speed: float) -> float:
        return _mcv50(table, edges, speed, wish).margin - wish.required_margin

    slow = 1e-3
    return 0.0 if reserve(slow) < 0.0 else float(brentq(reserve, slow, too_fast, xtol=1e-4))
