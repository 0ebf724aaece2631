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
        self._durations = np.diff(self.times)
        self.coefficients = _coefficients(
            self._durations[:, None], self.position, velocity, acceleration)

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
        return self._state(segment, time - self._starts[segment])

    def positions(self, times: Array) -> Array:
        """Positions (T, N) at times (T,) [s], as `sample` has them."""
        segment = np.searchsorted(self.times, times, side="right") - 1
        out = self.position[np.where(segment < 0, 0, -1)]
        inside = (segment >= 0) & (segment < len(self.coefficients))
        if inside.any():
            segment = segment[inside]
            x = (times[inside] - self.times[segment]) / self._durations[segment]
            out[inside] = (rows(x)[:, :1] @ self.coefficients[segment])[:, 0]
        return out

    def end_state(self) -> JointState:
        """State at the last knot as the last segment arrives there."""
        if not len(self.coefficients):
            return self.sample(self.end)
        return self._state(-1, float(self._durations[-1]))

    def inner_states(self, per_segment: int) -> tuple[Array, Array, Array]:
        """States spread evenly inside the segments, for checks of the whole motion.

        Args:
            per_segment: number of samples S a segment, both ends included.

        Returns:
            times ((K-1)*S,) [s], positions and velocities ((K-1)*S, N).
        """
        share = np.linspace(0.0, 1.0, per_segment)
        at_share = rows(share)
        h = self._durations[:, None]
        count = self.position.shape[1]
        position = (at_share[:, 0] @ self.coefficients).reshape(-1, count)
        velocity = (at_share[:, 1] @ self.coefficients / h[..., None]).reshape(-1, count)
        return (self.times[:-1, None] + h * share).ravel(), position, velocity

    def _state(self, segment: int, time: float) -> JointState:
        """State inside a segment, at a time since its start [s]."""
        h = float(self._durations[segment])
        state = rows(time / h) @ self.coefficients[segment]
        return JointState(state[0], state[1] / h, state[2] / h**2)


def _coefficients(h: Array, q: Array, v: Array | None, a: Array | None) -> Array:
    """Coefficients (K-1, 6, N) of each segment on [0, 1], from durations (K-1, 1) [s] and knots."""
    out = np.zeros((len(h), 6, q.shape[1]))
    rise = np.diff(q, axis=0)
    out[:, 0] = q[:-1]
    if v is None:
        out[:, 1] = rise
        return out
    v0, v1 = v[:-1] * h, v[1:] * h
    if a is None:
        out[:, 1] = v0
        out[:, 2] = 3.0 * rise - 2.0 * v0 - v1
        out[:, 3] = -2.0 * rise + v0 + v1
        return out
    return np.moveaxis(quintic(q[:-1], v0, a[:-1] * h**2, q[1:], v1, a[1:] * h**2), 0, 1).copy()
