"""The motion that a driver makes of the points of a joint trajectory.

`Spline` follows any trajectory message as ros2_control's JointTrajectoryController does, and rests
outside its points. `humanoid_motion.knots.Knots` is the planner's side: a planned motion whose
points all have position, velocity and acceleration. Both use the polynomial of
`humanoid_motion.quintic`.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

from humanoid_motion.quintic import quintic, rows


@dataclass(frozen=True)
class JointState:
    """Reference state of all joints at one time.

    Attributes:
        position: (N,) [rad].
        velocity: (N,) [rad/s].
        acceleration: (N,) [rad/s^2].
    """

    position: Array
    velocity: Array
    acceleration: Array


class Spline:
    """Joint motion through knots, one polynomial of degree five or less between two of them.

    Knots with positions alone give straight lines, with velocities cubics, with accelerations too
    quintics, as in ros2_control's JointTrajectoryController. Before the first knot and after the
    last one the joints rest there.

    Args:
        times: (K,) strictly increasing [s], K >= 1.
        position: (K, N) [rad].
        velocity: (K, N) [rad/s] or None.
        acceleration: (K, N) [rad/s^2] or None; asks for velocity.
    """

    def __init__(
        self,
        times: Array,
        position: Array,
        velocity: Array | None = None,
        acceleration: Array | None = None,
    ) -> None:
        self.times = np.array(times, dtype=float)
        self.position = np.array(position, dtype=float)
        self._starts = self.times.tolist()
        self.coefficients = _coefficients(self.times, self.position, velocity, acceleration)

    @property
    def start(self) -> float:
        """Time of the first knot [s]."""
        return self._starts[0]

    @property
    def end(self) -> float:
        """Time of the last knot [s]."""
        return self._starts[-1]

    def sample(self, time: float) -> JointState:
        """State at a time [s]; at rest outside the knots (at the last knot: at rest)."""
        segment = bisect_right(self._starts, time) - 1
        if segment < 0 or segment >= len(self.coefficients):
            rest = self.position[0 if segment < 0 else -1]
            return JointState(rest, np.zeros_like(rest), np.zeros_like(rest))
        return _state(time - self._starts[segment], self.coefficients[segment])

    def positions(self, times: Array) -> Array:
        """Positions (T, N) at times (T,) [s], as `sample` has them."""
        segment = np.searchsorted(self.times, times, side="right") - 1
        out = self.position[np.where(segment < 0, 0, -1)]
        inside = (segment >= 0) & (segment < len(self.coefficients))
        if inside.any():
            segment = segment[inside]
            powers = rows(times[inside] - self.times[segment])[:, :1]
            out[inside] = (powers @ self.coefficients[segment])[:, 0]
        return out

    def end_state(self) -> JointState:
        """State at the last knot as the last segment arrives there."""
        if not len(self.coefficients):
            return self.sample(self.end)
        return _state(self._starts[-1] - self._starts[-2], self.coefficients[-1])

    def inner_states(self, per_segment: int) -> tuple[Array, Array, Array]:
        """States spread evenly inside the segments, for checks of the whole motion.

        Args:
            per_segment: number of samples S a segment, both ends included.

        Returns:
            times ((K-1)*S,) [s], positions and velocities ((K-1)*S, N).
        """
        share = np.linspace(0.0, 1.0, per_segment)
        local = np.diff(self.times)[:, None] * share  # (segments, S)
        at = rows(local)
        count = self.position.shape[1]
        position = (at[:, :, 0] @ self.coefficients).reshape(-1, count)
        velocity = (at[:, :, 1] @ self.coefficients).reshape(-1, count)
        return (self.times[:-1, None] + local).ravel(), position, velocity


def _state(time: float, coefficients: Array) -> JointState:
    """State at a time since the start of a segment [s]."""
    return JointState(*(rows(time) @ coefficients))


def _coefficients(times: Array, q: Array, v: Array | None, a: Array | None) -> Array:
    """Coefficients of each segment in the time since its start, (K-1, 6, N)."""
    h = np.diff(times)[:, None]
    out = np.zeros((len(times) - 1, 6, q.shape[1]))
    rise = np.diff(q, axis=0)
    out[:, 0] = q[:-1]
    if v is None:
        out[:, 1] = rise / h
    elif a is None:
        v0, v1 = v[:-1], v[1:]
        out[:, 1] = v0
        out[:, 2] = (3.0 * rise / h - 2.0 * v0 - v1) / h
        out[:, 3] = (-2.0 * rise / h + v0 + v1) / h**2
    else:
        joined = quintic(h, (q[:-1], v[:-1], a[:-1]), (q[1:], v[1:], a[1:]))
        for power, coefficient in enumerate(joined):
            out[:, power] = coefficient
    return out
