"""The run-up, section II.C.4: the CoM goes to the door along the first half of MCV50, or along the
course with the largest ZMP margin (`zmp_run_up`)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import Dynamics, inverse_dynamics
from humanoid_motion.errors import JointLimit
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.zmp import edge_margin, margins
from scipy.optimize import brentq, minimize_scalar

from impact_planner.errors import InvalidRequest, SpeedUnreachable
from impact_planner.hit.stance import Stance, sole_edges
from impact_planner.motion.cam_curve import RunUp
from impact_planner.motion.post import path_time
from impact_planner.motion.posture_table import PostureTable
from impact_planner.motion.zmp_run_up import SmoothRunUp, best_run_up, fastest_run_up

Law = RunUp | SmoothRunUp

_SLOWEST = 0.05  # of point B [m/s]
_SHORTEST_WAY = 0.05  # of a run-up [m]
_REACH = 0.1  # past the hit, as far as the legs allow: slowly after it, or for a late contact [m]
_SEARCH_SAMPLES = 100  # of a trial run-up's ZMP
_STOP = 0.3  # of the stop after a contact that is missed, where the legs reach far enough [s]
_STOP_WAY = 0.02  # that the overrun leaves for that stop, where `RunUpWish.steady` does [m]


@dataclass(frozen=True)
class RunUpWish:
    """What a run-up is to be.

    Attributes:
        kind: ``mcv50``, the paper's, or ``zmp_limited``.
        v_rb: Speed of point B before the hit [m/s].
        steady: At constant speed so far before and past the nominal contact at least, for a door
            that is nearer or farther [m].
        overrun: Way past the nominal contact that is wished for [m].
        required_margin: Smallest ZMP margin allowed [m].
        joint_share: Of the joints' speed limits that may be used.
        period: Of the samples [s].
        y_start: y of the CoM at the start of MCV50 [m]; None: where the margin is largest.
    """

    kind: str
    v_rb: float
    steady: float
    overrun: float
    required_margin: float
    joint_share: float
    period: float
    y_start: float | None = None


@dataclass(frozen=True)
class RunUpPlan:
    """A run-up that keeps its balance.

    Attributes:
        table: Its postures.
        y_start: y of the CoM at the start [m].
        y_hit: y of the CoM at the nominal contact [m].
        overrun: How far it goes on at constant speed for a late contact [m].
        law: Time law of the CoM.
        motion: Samples, from the start to rest past the overrun, for a contact that is missed.
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


def plan_run_up(robot: RobotModel, stance: Stance, wish: RunUpWish) -> RunUpPlan:
    """Plan the run-up that brings point B to a speed at the contact.

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        wish: What it is to be.

    Raises:
        InvalidRequest: y_start leaves no way to go.
        SpeedUnreachable: The ZMP would come nearer to the edge than allowed, or the hit is too
            slow to plan; value and limit are v_rb and the speed of B that can be reached [m/s].
        PostureUnreachable, JointLimit: The legs do not allow it.
    """
    _require_room_and_speed(wish, float(stance.posture.com[1]))
    return time_run_up(robot, stance, PostureTable(robot, stance, _REACH), wish)


def time_run_up(
    robot: RobotModel, stance: Stance, table: PostureTable, wish: RunUpWish
) -> RunUpPlan:
    """Time a run-up along postures that are known; arguments and errors as `plan_run_up`."""
    edges = sole_edges(robot, stance.feet)
    speed = wish.v_rb / table.waist_per_com(table.y_hit)
    chosen = _best(table, edges, wish, speed)
    if chosen is None or chosen.margin < wish.required_margin:
        raise _too_fast(table, edges, wish, chosen)
    overrun = usable_overrun(robot, table, speed, wish)
    return _timed(robot, stance, table, chosen, overrun, wish.period)


def usable_overrun(
    robot: RobotModel, table: PostureTable, speed: float, wish: RunUpWish
) -> float:
    """How far the run-up can go on past the contact at full speed, at most as wished [m].

    What is left of the legs' reach is for the stop after a contact that is missed. Towards its end
    the left leg is nearly stretched, and its knee the faster for it.

    Args:
        robot: The robot.
        table: Postures of the run-up.
        speed: Of the CoM [m/s].
        wish: What the run-up is to be.

    Raises:
        JointLimit: Not even `wish.steady` keeps the joints' limits.
    """
    reach = table.y_hit - table.low
    longest = min(wish.overrun, reach, max(wish.steady, reach - _STOP_WAY))
    way = np.linspace(0.0, longest, 33)
    ratio = speed * np.abs(table.joint_slopes(table.y_hit - way)) / robot.speed_limit
    over = np.flatnonzero((ratio > wish.joint_share).any(axis=1))
    granted = float(way[over[0] - 1]) if over.size and over[0] else (0.0 if over.size else longest)
    if granted >= wish.steady - 1e-9:
        return granted
    if not over.size:
        raise JointLimit(
            f"cam: the legs reach {1e3 * longest:.0f} mm past the nominal contact, "
            f"{1e3 * wish.steady:.0f} mm are needed for a door that is farther",
            phase="cam", quantity="overrun [m]", value=longest, limit=wish.steady)
    at = int(np.searchsorted(way, min(wish.steady, longest)))
    joint = int(np.argmax(ratio[at]))
    name, limit = robot.joint_names[joint], wish.joint_share * float(robot.speed_limit[joint])
    value = float(ratio[at, joint] * robot.speed_limit[joint])
    raise JointLimit(
        f"cam: {name} would turn at {value:.2f} rad/s {1e3 * way[at]:.0f} mm past the nominal "
        f"contact, {limit:.2f} rad/s are allowed ({100.0 * wish.joint_share:.0f} % of its limit)",
        joint=name, phase="cam", quantity="speed [rad/s]", value=value, limit=limit)


def _require_room_and_speed(wish: RunUpWish, y_hit: float) -> None:
    """Refuse a start that leaves no way to go, and a hit too slow to plan."""
    if wish.y_start is not None and wish.y_start < y_hit + _SHORTEST_WAY:
        raise InvalidRequest(
            f"y_start {wish.y_start:.3f} m leaves no run-up to the hit at y = {y_hit:.3f} m",
            quantity="y_start [m]",
            value=wish.y_start,
            limit=y_hit + _SHORTEST_WAY,
        )
    if wish.v_rb < _SLOWEST:
        raise SpeedUnreachable(
            f"a hit at v_rB = {wish.v_rb:.2g} m/s is slower than run-ups are planned for, "
            f"{_SLOWEST} m/s",
            quantity="v_rb [m/s]",
            value=wish.v_rb,
            limit=_SLOWEST,
        )


@dataclass(frozen=True)
class _Candidate:
    """A run-up that may be chosen."""

    law: Law
    y_start: float
    margin: float  # along y [m]


def _best(
    table: PostureTable, edges: tuple[float, float], wish: RunUpWish, speed: float
) -> _Candidate | None:
    """The run-up of a kind with the largest margin at a speed of the CoM [m/s]."""
    if wish.kind == "zmp_limited":
        found = best_run_up(
            table.zmp, edges, speed=speed, y_hit=table.y_hit, highest=_highest(table, wish),
            steady=wish.steady)
        return None if found is None else _Candidate(*found)
    return _mcv50(table, edges, speed, wish)


def _highest(table: PostureTable, wish: RunUpWish) -> float:
    return table.high if wish.y_start is None else min(wish.y_start, table.high)


def _mcv50(
    table: PostureTable, edges: tuple[float, float], speed: float, wish: RunUpWish
) -> _Candidate:
    """MCV50 from a given start, or from where its margin is largest."""

    def candidate(y0: float) -> _Candidate:
        law = RunUp(speed=speed, distance=y0 - table.y_hit)
        course = law.at(np.linspace(0.0, law.duration, _SEARCH_SAMPLES))
        zmp = table.zmp(y0 - course.s, -course.v, -course.a)
        return _Candidate(law, y0, float(edge_margin(zmp, edges)))

    if wish.y_start is not None:
        return candidate(_highest(table, wish))
    result = minimize_scalar(
        lambda y0: -candidate(y0).margin,
        bounds=(table.y_hit + _SHORTEST_WAY, table.high),
        method="bounded",
        options={"xatol": 5e-4},
    )
    return candidate(float(result.x))


def _timed(
    robot: RobotModel,
    stance: Stance,
    table: PostureTable,
    chosen: _Candidate,
    overrun: float,
    period: float,
) -> RunUpPlan:
    """Samples of a run-up, with their dynamics."""
    law, y0 = chosen.law, chosen.y_start
    end = law.duration + overrun / law.speed
    time = np.append(np.arange(0.0, end - 0.25 * period, period), end)
    time = np.union1d(time, [law.duration])
    time = time[np.append(True, np.diff(time) > 1e-6)]
    # There the way to rest of `path_time` is half of its duration times the speed.
    reach = 2.0 * (table.y_hit - table.low - overrun) / law.speed
    stop = min(_STOP, reach)
    if stop > 0.0:
        time = np.append(time, end + np.linspace(0.0, stop, math.ceil(stop / period) + 1)[1:])
    late = np.maximum(time - end, 0.0)
    ahead, rate, slope = path_time(late, end, 1.0, stop or period)
    course = law.at(np.where(late > 0.0, ahead, time))
    rate, slope = (np.where(late > 0.0, one, plain) for one, plain in ((rate, 1.0), (slope, 0.0)))
    motion = table.motion(
        time, y0 - course.s, -course.v * rate, -course.a * rate**2 - course.v * slope)
    dynamics = inverse_dynamics(robot, motion)
    # Past the contact there is no run-up, only a reserve: its ZMP counts up to the contact.
    counted = time <= law.duration + 0.5 * period
    margin = margins(robot, dynamics.zmp[counted], stance.feet, SIDES)
    return RunUpPlan(
        table, y0, table.y_hit, overrun, law, motion, dynamics, float(np.min(margin)))


def _too_fast(
    table: PostureTable, edges: tuple[float, float], wish: RunUpWish, chosen: _Candidate | None
) -> SpeedUnreachable:
    """The error that names the speed of B that can be reached."""
    reached = _fastest(table, edges, wish) * table.waist_per_com(table.y_hit)
    reason = "no course leads there" if chosen is None else (
        f"the ZMP would come to {1e3 * chosen.margin:.1f} mm from the edge of the soles, "
        f"{1e3 * wish.required_margin:.1f} mm are required")
    other = "; zmp_limited reaches more" if wish.kind == "mcv50" else ""
    return SpeedUnreachable(
        f"a hit at v_rB = {wish.v_rb:.3f} m/s is too fast: {reason}; {wish.kind} reaches "
        f"v_rB = {reached:.3f} m/s there{other}",
        quantity="v_rb [m/s]",
        value=wish.v_rb,
        limit=reached,
    )


def _fastest(table: PostureTable, edges: tuple[float, float], wish: RunUpWish) -> float:
    """Largest speed of the CoM at which the margin is as required; 0 where none is [m/s]."""
    too_fast = wish.v_rb / table.waist_per_com(table.y_hit)
    if wish.kind == "zmp_limited":
        return fastest_run_up(
            table.zmp, edges, margin=wish.required_margin, most=too_fast, y_hit=table.y_hit,
            highest=_highest(table, wish), steady=wish.steady)

    def reserve(speed: float) -> float:
        return _mcv50(table, edges, speed, wish).margin - wish.required_margin

    slow = 1e-3
    return 0.0 if reserve(slow) < 0.0 else float(brentq(reserve, slow, too_fast, xtol=1e-4))


def capture_reserve(
    robot: RobotModel, stance: Stance, plan: RunUpPlan, way: Array, speed: Array
) -> Array:
    """Distance of the capture point to the soles' edge towards the door, (N,) [m].

    By the capture point of the linear inverted pendulum (Pratt et al., 2006) the robot can come to
    rest on its feet while y + ydot / sqrt(g / h) is inside the support polygon.

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        plan: The run-up.
        way: Of the CoM from the start of the run-up, (N,) [m].
        speed: Of the CoM towards the door, (N,) [m/s].
    """
    omega = math.sqrt(GRAVITY / stance.posture.b_r)
    return np.asarray(plan.y_start - way - speed / omega - sole_edges(robot, stance.feet)[0])
