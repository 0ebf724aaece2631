"""Postures of the run-up and the wrench of the floor, tabulated over the place of the CoM.

The upper body and the height of the hip are fixed (section II.C.4), so that every posture of the
run-up is a point of a one-dimensional table q(y). Along the table, the wrench of the floor is
``G(y) + C(y) v^2 + M(y) a`` for a speed v and an acceleration a of the CoM (dynamics along a path,
Bobrow, Dubowsky and Gibson, 1985). The ZMP of another time law therefore costs almost nothing.
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
from humanoid_motion.zmp import edge_margin
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from impact_planner.hit.stance import HitStance, braced_over, sole_edges

_STEP = 0.005  # largest step between tabulated places of the CoM [m]
_FEWEST = 8  # smallest number of places that the spline needs


class PostureTable:
    """Postures over the y coordinate of the CoM, within the legs' reach.

    Args:
        overrun: Largest distance past the nominal contact; the legs' reach may shorten it [m].

    Attributes:
        edges: Lowest and highest y of both soles together in odom [m].
        y_hit: y of the CoM at the nominal contact in odom [m].
        low: Smallest y of the table, at the end of the overrun [m].
        high: Largest y of the table, at the farthest start of a run-up [m].

    Raises:
        PostureUnreachable: No start of a run-up is within the legs' reach.
    """

    def __init__(self, robot: RobotModel, stance: HitStance, overrun: float) -> None:
        self._robot = robot
        self.edges = sole_edges(robot, stance.feet)
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
                f"the legs reach no start of a run-up between y = {lowest} and {highest} m; move "
                "the door nearer",
                quantity="y_start [m]",
                value=float(y[rows][-1]) if rows.stop > rows.start else math.nan,
                limit=(lowest, highest),
                phase="cam",
            )
        self.low, self.high = float(y[rows][0]), float(y[rows][-1])
        self._nodes = y[rows]
        spline = make_interp_spline(y[rows], np.hstack([joints, base])[rows], k=5)
        self._spline = (spline, spline.derivative(1), spline.derivative(2))

    def at(self, y: ArrayLike) -> Array:
        """Compute joints [rad] and base [m] for places y of the CoM [m], (N, J + 3)."""
        return np.asarray(self._spline[0](np.asarray(y, dtype=float)))

    def motion(self, time: Array, y: Array, speed: Array, acceleration: Array) -> Motion:
        """Make the motion along the table for a course of the CoM.

        Args:
            time: Times, (N,) [s].
            y: Places of the CoM, (N,) [m].
            speed: Speeds of the CoM along y, (N,) [m/s].
            acceleration: Accelerations of the CoM along y, (N,) [m/s^2].
        """
        slope = self._spline[1](y)
        curve = self._spline[2](y)
        v, a = speed[:, None], acceleration[:, None]
        return from_derivatives(time, self.at(y), slope * v, curve * v**2 + slope * a)

    def waist_per_com(self, y: float) -> float:
        """Compute the speed of the upper body and point B over that of the CoM."""
        return float(self._spline[1](y)[-2])

    def joint_slopes(self, y: ArrayLike) -> Array:
        """Compute the speeds of the joints over that of the CoM, (N, J) [rad/m]."""
        return np.asarray(self._spline[1](np.asarray(y, dtype=float))[..., :-3])

    def margin(self, y: Array, v: Array, a: Array) -> Array:
        """Compute the smallest distance of the ZMP from the soles' edges along y [m].

        Args:
            y: Places of the CoM, one course or several, (..., N) [m].
            v: Its speeds, in the same shape or (N,) [m/s].
            a: Its accelerations likewise [m/s^2].

        Returns:
            Distances (...), negative where the ZMP leaves the edges.
        """
        return edge_margin(self.zmp(y, v, a), self.edges)

    def zmp(self, y: Array, v: Array, a: Array) -> Array:
        """Compute y of the ZMP for places, speeds and accelerations of the CoM along y [m].

        All arguments and the result have one shape.
        """
        rows = self._wrench(y)
        at_rest, by_speed, by_acceleration = (rows[..., i, :] for i in range(3))
        wrench = at_rest + by_speed * (v**2)[..., None] + by_acceleration * a[..., None]
        return np.asarray(wrench[..., 1] / wrench[..., 0])

    @cached_property
    def _wrench(self):  # type: ignore[no-untyped-def]
        """Spline of G, C and M over y: vertical force [N] and moment about x [N m], (N, 3, 2)."""
        y, n = self._nodes, len(self._nodes)
        zero, one = np.zeros(n), np.ones(n)
        found = []
        for v, a in ((zero, zero), (one, zero), (zero, one)):
            force, moment = floor_wrenches(self._robot, self.motion(zero, y, v, a))
            found.append(np.column_stack([force[:, 2], moment[:, 0]]))
        at_rest, moving, accelerated = found
        return make_interp_spline(
            y, np.stack([at_rest, moving - at_rest, accelerated - at_rest], axis=1), k=5)


def _around(inside: NDArray[np.bool_], middle: int) -> slice:
    """Return the contiguous rows inside around the row `middle`; empty where it is outside."""
    outside = np.flatnonzero(~inside)
    first = outside[outside <= middle].max(initial=-1) + 1
    last = outside[outside >= middle].min(initial=len(inside))
    return slice(int(first), int(max(first, last)))
