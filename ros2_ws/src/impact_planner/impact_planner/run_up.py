"""The run-up, section II.C.4: the CoM goes to the door along the first half of MCV50, or along the
course with the largest ZMP margin (`zmp_run_up`).

The upper body and the height of the hip are fixed, so that every posture of the run-up is a
point of a one-dimensional table q(y). Timing it anew costs next to nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize_scalar

from .cam_curve import RunUp
from .errors import InvalidRequest, PlannerError, PostureUnreachable, SpeedUnreachable
from .posture import braced_upper_body
from .robot_model import SIDES, RobotModel
from .stance import SHORTEST_OVERRUN, Stance, com_x
from .trajectories import Motion, from_derivatives
from .whole_body import require_joint_limits, solve
from .zmp import Dynamics, inverse_dynamics, margins
from .zmp_run_up import SmoothRunUp, best_run_up

Array = NDArray[np.float64]
Law = RunUp | SmoothRunUp

GRAVITY = 9.81  # [m/s^2]
_OVERRUN_STEP = 0.0025  # [m]
_SLOWEST = 0.05  # of point B [m/s]
_TABLE_STEP = 0.005  # [m]
_SHORTEST_WAY = 0.05  # of a run-up [m]
_STEADY = 0.015  # at constant speed before the nominal contact, for a door that is nearer [m]
_SEARCH_SAMPLES = 100  # of a trial run-up's ZMP


class PostureTable:
    """Postures q(y) of the run-up over the y coordinate of the CoM."""

    def __init__(self, robot: RobotModel, stance: Stance, y_from: float, y_to: float) -> None:
        """Solve the whole-body inverse kinematics between two y [m].

        Raises:
            PostureUnreachable: A leg does not reach.
        """
        self.low, self.high = min(y_from, y_to), max(y_from, y_to)
        n = max(8, math.ceil((self.high - self.low) / _TABLE_STEP) + 1)
        y = np.linspace(self.low, self.high, n)
        joints, base = solve(
            robot,
            upper=braced_upper_body(robot),
            com_xy=np.column_stack([np.full(n, com_x(robot)), y]),
            waist_z=stance.posture.waist_height,
            feet=stance.feet,
        )
        spline = make_interp_spline(y, np.hstack([joints, base]), k=5)
        self._spline = (spline, spline.derivative(1), spline.derivative(2))

    def at(self, y: ArrayLike) -> Array:
        """Joints and base at y, (N, 33)."""
        return np.asarray(self._spline[0](np.asarray(y, dtype=float)))

    def motion(self, time: Array, y: Array, speed: Array, acceleration: Array) -> Motion:
        """Motion along the table for a course y(t); all arguments (N,), SI units."""
        slope = self._spline[1](y)
        curve = self._spline[2](y)
        v, a = speed[:, None], acceleration[:, None]
        return from_derivatives(time, self.at(y), slope * v, curve * v**2 + slope * a)

    def waist_per_com(self, y: float) -> float:
        """Speed of the upper body, so of point B, for a unit speed of the CoM."""
        return float(self._spline[1](y)[-2])


@dataclass(frozen=True)
class RunUpPlan:
    """A run-up that keeps its balance.

    Attributes:
        table: Its postures.
        y_start: y of the CoM at the start [m].
        y_hit: y of the CoM at the nominal contact [m].
        overrun: How far it goes on at constant speed for a late contact [m].
        law: Time law of the CoM.
        motion: Samples, from the start to the end of the overrun.
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


def usable_overrun(robot: RobotModel, stance: Stance, v_rb: float, wanted: float) -> float:
    """How far the run-up can go on past the contact at full speed, at most `wanted` [m].

    Towards its end the left leg is nearly stretched, and its knee the faster for it.

    Raises:
        PostureUnreachable, JointLimit: Not even `SHORTEST_OVERRUN` is within reach.
    """
    y_hit = float(stance.posture.com[1])
    shortest = min(SHORTEST_OVERRUN, wanted)
    count = max(1, math.ceil((wanted - shortest) / _OVERRUN_STEP) + 1)
    failure: PlannerError | None = None
    for overrun in np.linspace(wanted, shortest, count):
        try:
            table = PostureTable(robot, stance, y_hit, y_hit - float(overrun))
            y = np.linspace(table.high, table.low, 5)
            speed = np.full(5, -v_rb / table.waist_per_com(y_hit))
            motion = table.motion(np.zeros(5), y, speed, np.zeros(5))
            require_joint_limits(robot, motion, "cam")
            return float(overrun)
        except PlannerError as error:
            failure = error
    assert failure is not None
    raise failure


def plan_run_up(
    robot: RobotModel,
    stance: Stance,
    v_rb: float,
    *,
    period: float,
    overrun: float,
    required_margin: float,
    y_start: float | None = None,
    kind: str = "mcv50",
) -> RunUpPlan:
    """Plan the run-up that brings point B to a speed at the contact.

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        v_rb: Speed of point B before the hit [m/s].
        period: Sampling period [s].
        overrun: Way at constant speed past the nominal contact, as far as limits allow [m].
        required_margin: Smallest ZMP margin allowed [m].
        y_start: y of the CoM at the start of MCV50 [m]; None: where the margin is largest.
        kind: ``mcv50``, the paper's, or ``zmp_limited``.

    Raises:
        InvalidRequest: y_start leaves no way to go.
        SpeedUnreachable: The ZMP would come nearer to the edge than allowed, or the hit is too
            slow to plan; value and limit are
            v_rb and the speed of B that can be reached [m/s].
        PostureUnreachable, JointLimit: The legs do not allow it.
    """
    y_hit = float(stance.posture.com[1])
    _require_room_and_speed(v_rb, y_start, y_hit)
    overrun = usable_overrun(robot, stance, 0.0, overrun)
    highest = _highest_start(robot, stance, y_hit) if y_start is None else y_start
    table = PostureTable(robot, stance, highest, y_hit - overrun)
    speed = v_rb / table.waist_per_com(y_hit)

    def best(v_com: float) -> _Candidate | None:
        """Best run-up at a speed of the CoM."""
        if kind == "zmp_limited":
            return _zmp_limited(robot, stance, table, y_hit, highest, v_com)
        return _mcv50(robot, stance, table, y_hit, highest, v_com, y_start)

    chosen = best(speed)
    if chosen is None or chosen.margin < required_margin:
        reached = _fastest(best, required_margin, speed)
        ratio = table.waist_per_com(y_hit)
        reason = "no course leads there" if chosen is None else (
            f"the ZMP would come to {1e3 * chosen.margin:.1f} mm from the edge of the soles, "
            f"{1e3 * required_margin:.1f} mm are required")
        other = "; zmp_limited reaches more" if kind == "mcv50" else ""
        raise SpeedUnreachable(
            f"a hit at v_rB = {v_rb:.3f} m/s is too fast: {reason}; {kind} reaches "
            f"v_rB = {reached * ratio:.3f} m/s there{other}",
            quantity="v_rb [m/s]",
            value=v_rb,
            limit=reached * ratio,
        )
    overrun = usable_overrun(robot, stance, v_rb, overrun)
    return _timed(robot, stance, table, chosen, y_hit, overrun, period)


def _require_room_and_speed(v_rb: float, y_start: float | None, y_hit: float) -> None:
    """Refuse a start that leaves no way to go, and a hit too slow to plan."""
    if y_start is not None and y_start < y_hit + _SHORTEST_WAY:
        raise InvalidRequest(
            f"y_start {y_start:.3f} m leaves no run-up to the hit at y = {y_hit:.3f} m",
            quantity="y_start [m]",
            value=y_start,
            limit=y_hit + _SHORTEST_WAY,
        )
    if v_rb < _SLOWEST:
        raise SpeedUnreachable(
            f"a hit at v_rB = {v_rb:.2g} m/s is slower than run-ups are planned for, "
            f"{_SLOWEST} m/s",
            quantity="v_rb [m/s]",
            value=v_rb,
            limit=_SLOWEST,
        )


def _highest_start(robot: RobotModel, stance: Stance, y_hit: float) -> float:
    """Leftmost start that the legs reach [m]."""
    lowest, highest = robot.config.run_up_start
    for y in np.arange(highest, lowest, -0.01):
        try:
            table = PostureTable(robot, stance, float(y), y_hit)
            still = np.zeros(1)
            require_joint_limits(robot, table.motion(still, np.array([y]), still, still), "cam")
            return float(y)
        except PlannerError:
            continue
    raise PostureUnreachable(
        "the legs reach no start of a run-up between "
        f"y = {lowest} and {highest} m",
        quantity="y_start [m]",
        value=float("nan"),
        limit=(lowest, highest),
    )


@dataclass(frozen=True)
class _Candidate:
    """A run-up that may be chosen."""

    law: Law
    y_start: float
    margin: float  # [m]


def _mcv50(
    robot: RobotModel,
    stance: Stance,
    table: PostureTable,
    y_hit: float,
    highest: float,
    speed: float,
    y_start: float | None,
) -> _Candidate:
    """MCV50 from a given start, or from where its margin is largest."""

    def candidate(y0: float) -> _Candidate:
        law = RunUp(speed=speed, distance=y0 - y_hit)
        return _Candidate(law, y0, _coarse_margin(robot, stance, table, law, y0))

    if y_start is not None:
        return candidate(y_start)
    result = minimize_scalar(
        lambda y0: -candidate(y0).margin,
        bounds=(max(robot.config.run_up_start[0], y_hit + _SHORTEST_WAY), highest),
        method="bounded",
        options={"xatol": 5e-4},
    )
    return candidate(float(result.x))


def _zmp_limited(
    robot: RobotModel,
    stance: Stance,
    table: PostureTable,
    y_hit: float,
    highest: float,
    speed: float,
) -> _Candidate | None:
    """The course with the largest margin."""

    def zmp(y: Array, v: Array, a: Array) -> Array:
        return inverse_dynamics(robot, table.motion(np.zeros(len(y)), y, v, a)).zmp[:, 1]

    sides = [robot.feet[side].corners(stance.feet[side])[:, 1] for side in SIDES]
    edges = float(np.min(sides)), float(np.max(sides))
    found = best_run_up(
        zmp, edges, speed=speed, y_hit=y_hit, highest=highest, steady=_STEADY)
    if found is None:
        return None
    law, y0 = found
    return _Candidate(law, y0, _coarse_margin(robot, stance, table, law, y0))


def _timed(
    robot: RobotModel,
    stance: Stance,
    table: PostureTable,
    chosen: _Candidate,
    y_hit: float,
    overrun: float,
    period: float,
) -> RunUpPlan:
    """Samples of a run-up, with their dynamics."""
    law, y0 = chosen.law, chosen.y_start
    end = law.duration + overrun / law.speed
    time = np.append(np.arange(0.0, end - 0.25 * period, period), end)
    course = law.at(time)
    motion = table.motion(time, y0 - course.s, -course.v, -course.a)
    dynamics = inverse_dynamics(robot, motion)
    # Past the contact there is no run-up, only a reserve: its ZMP counts up to the contact.
    counted = time <= law.duration + 0.5 * period
    margin = margins(robot, dynamics.zmp[counted], stance.feet, SIDES)
    return RunUpPlan(table, y0, y_hit, overrun, law, motion, dynamics, float(np.min(margin)))


def _coarse_margin(
    robot: RobotModel, stance: Stance, table: PostureTable, law: Law, y0: float
) -> float:
    """Smallest margin of a run-up [m], at few samples."""
    time = np.linspace(0.0, law.duration, _SEARCH_SAMPLES)
    course = law.at(time)
    motion = table.motion(time, y0 - course.s, -course.v, -course.a)
    zmp = inverse_dynamics(robot, motion).zmp
    return float(np.min(margins(robot, zmp, stance.feet, SIDES)))


def _fastest(
    best: Callable[[float], _Candidate | None], required: float, too_fast: float
) -> float:
    """Largest speed of the CoM at which the margin is as required [m/s]."""
    low, high = 0.0, too_fast
    for _ in range(12):
        middle = 0.5 * (low + high)
        chosen = best(middle) if middle > 0.0 else None
        if chosen is not None and chosen.margin >= required:
            low = middle
        else:
            high = middle
    return low


def point_of_no_return(plan: RunUpPlan, robot: RobotModel, stance: Stance) -> float:
    """Time before the contact after which the run-up can no longer be stopped in balance [s].

    By the capture point of the linear inverted pendulum (Pratt et al., 2006): the robot can come
    to rest on its feet while y + ydot / sqrt(g / h) is inside the support polygon. Negative where
    that holds beyond the nominal contact.
    """
    edge = float(np.min(robot.feet["right"].corners(stance.feet["right"])[:, 1]))
    omega = math.sqrt(GRAVITY / stance.posture.b_r)
    time = np.linspace(0.0, plan.motion.duration, 400)
    course = plan.law.at(time)
    reserve = plan.y_start - course.s - course.v / omega - edge
    lost = np.flatnonzero(reserve < 0.0)
    if not lost.size:
        return plan.contact_time - plan.motion.duration
    i = int(lost[0])
    if i == 0:
        return plan.contact_time
    part = reserve[i - 1] / (reserve[i - 1] - reserve[i])
    return float(plan.contact_time - (time[i - 1] + part * (time[i] - time[i - 1])))
