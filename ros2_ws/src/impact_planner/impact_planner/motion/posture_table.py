"""Postures of the run-up, and what the floor must bear, over the place of the CoM.

The upper body and the height of the hip are fixed (section II.C.4), so that every posture of the
run-up is a point of a one-dimensional table q(y). Along it the wrench of the floor is
``G(y) + C(y) v^2 + M(y) a`` for a speed v and an acceleration a of the CoM (the dynamics along a
path of Bobrow, Dubowsky and Gibson, 1985), so that timing a run-up anew costs next to nothing.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.dynamics import floor_wrenches
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.motion import Motion, from_derivatives
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import within_ranges
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from impact_planner.hit.stance import Stance, braced_over

_STEP = 0.005  # [m]
_FEWEST = 8  # places that a spline needs


class PostureTable:
    """Postures over the y coordinate of the CoM, as far as the legs reach.

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        overrun: Way past the nominal contact, as far as the legs reach [m].

    Attributes:
        y_hit: y of the CoM at the nominal contact [m].
        low: Where the overrun ends [m].
        high: Leftmost start of a run-up [m].

    Raises:
        PostureUnreachable: The legs reach no start of a run-up.
    """

    def __init__(self, robot: RobotModel, stance: Stance, overrun: float) -> None:
        self._robot = robot
        self.y_hit = float(stance.posture.com[1])
        lowest, highest = robot.config.run_up_start
        before = max(0.0, highest - self.y_hit)
        y = self.y_hit + np.concatenate([
            -np.linspace(overrun, 0.0, math.ceil(overrun / _STEP) + 1)[:-1],
            np.linspace(0.0, before, math.ceil(before / _STEP) + 1)])
        joints, base = braced_over(
            robot, y, stance.posture.waist_height, stance.feet, strict=False)
        inside = np.all(within_ranges(robot, joints), axis=1)
        rows = _around(inside, int(np.argmin(np.abs(y - self.y_hit))))
        if rows.stop - rows.start < _FEWEST or y[rows.stop - 1] < lowest:
            raise PostureUnreachable(
                "the legs reach no start of a run-up between "
                f"y = {lowest} and {highest} m",
                quantity="y_start [m]",
                value=float(y[rows][-1]) if rows.stop > rows.start else math.nan,
                limit=(lowest, highest),
            )
        self.low, self.high = float(y[rows][0]), float(y[rows][-1])
        self._nodes = y[rows]
        spline = make_interp_spline(y[rows], np.hstack([joints, base])[rows], k=5)
        self._spline = (spline, spline.derivative(1), spline.derivative(2))

    def at(self, y: ArrayLike) -> Array:
        """Joints and base at y, (N, J + 3)."""
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

    def joint_slopes(self, y: ArrayLike) -> Array:
        """Speeds of the joints for a unit speed of the CoM, (N, J) [rad/m]."""
        return np.asarray(self._spline[1](np.asarray(y, dtype=float))[..., :-3])

    def zmp(self, y: Array, v: Array, a: Array) -> Array:
        """ZMP along y for places, speeds and accelerations of the CoM, all of one shape [m]."""
        rows = self._wrench(y)
        still, fast, pushed = (rows[..., i, :] for i in range(3))
        wrench = still + fast * (v**2)[..., None] + pushed * a[..., None]
        return np.asarray(wrench[..., 1] / wrench[..., 0])

    @cached_property
    def _wrench(self):  # type: ignore[no-untyped-def]
        """Spline of the floor's vertical force and moment about x, (N, 3, 2): G, C and M."""
        y, n = self._nodes, len(self._nodes)
        zero, one = np.zeros(n), np.ones(n)
        found = []
        for v, a in ((zero, zero), (one, zero), (zero, one)):
            force, moment = floor_wrenches(self._robot, self.motion(zero, y, v, a))
            found.append(np.column_stack([force[:, 2], moment[:, 0]]))
        still, fast, pushed = found
        return make_interp_spline(y, np.stack([still, fast - still, pushed - still], axis=1), k=5)


def _around(inside: NDArray[np.bool_], middle: int) -> slice:
    """The run of rows inside that holds a row; empty where that is outside."""
    outside = np.flatnonzero(~inside)
    first = outside[outside <= middle].max(initial=-1) + 1
    last = outside[outside >= middle].min(initial=len(inside))
    return slice(int(first), int(max(first, last)))
