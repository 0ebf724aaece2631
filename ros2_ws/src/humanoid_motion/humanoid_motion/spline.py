"""Piecewise polynomials between the points of a joint trajectory."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

_DEGREE = 5
_POWERS = np.arange(_DEGREE + 1)


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
        state = _basis(time - self._starts[segment]) @ self.coefficients[segment]
        return JointState(state[0], state[1], state[2])

    def positions(self, times: Array) -> Array:
        """Positions (T, N) at times (T,) [s], as `sample` has them."""
        segment = np.searchsorted(self.times, times, side="right") - 1
        out = self.position[np.where(segment < 0, 0, -1)]
        inside = (segment >= 0) & (segment < len(self.coefficients))
        if inside.any():
            segment = segment[inside]
            powers = (times[inside] - self.times[segment])[:, None] ** _POWERS
            out[inside] = (powers[:, None, :] @ self.coefficients[segment])[:, 0]
        return out

    def end_state(self) -> JointState:
        """State at the last knot as the last segment arrives there."""
        if not len(self.coefficients):
            return self.sample(self.end)
        state = _basis(self._starts[-1] - self._starts[-2]) @ self.coefficients[-1]
        return JointState(state[0], state[1], state[2])

    def inner_states(self, per_segment: int) -> tuple[Array, Array, Array]:
        """States spread evenly inside the segments, for checks of the whole motion.

        Args:
            per_segment: number of samples S a segment, both ends included.

        Returns:
            times ((K-1)*S,) [s], positions and velocities ((K-1)*S, N).
        """
        durations = np.diff(self.times)
        share = np.linspace(0.0, 1.0, per_segment)
        local = durations[:, None] * share  # (segments, S)
        powers = local[..., None] ** _POWERS
        slopes = np.zeros_like(powers)
        slopes[..., 1:] = _POWERS[1:] * powers[..., :-1]
        count = self.position.shape[1]
        position = (powers @ self.coefficients).reshape(-1, count)
        velocity = (slopes @ self.coefficients).reshape(-1, count)
        return (self.times[:-1, None] + local).ravel(), position, velocity


def _basis(t: float) -> Array:
    """Rows that give position, velocity and acceleration from the six coefficients."""
    t2, t3, t4 = t * t, t * t * t, t * t * t * t
    return np.array(
        [
            [1.0, t, t2, t3, t4, t4 * t],
            [0.0, 1.0, 2.0 * t, 3.0 * t2, 4.0 * t3, 5.0 * t4],
            [0.0, 0.0, 2.0, 6.0 * t, 12.0 * t2, 20.0 * t3],
        ]
    )


def _coefficients(times: Array, q: Array, v: Array | None, a: Array | None) -> Array:
    """(K-1, 6, N) polynomial coefficients in the time since each segment's start."""
    h = np.diff(times)[:, None]
    out = np.zeros((len(times) - 1, _DEGREE + 1, q.shape[1]))
    rise = np.diff(q, axis=0)
    out[:, 0] = q[:-1]
    if v is None:
        out[:, 1] = rise / h
        return out
    v0, v1 = v[:-1], v[1:]
    out[:, 1] = v0
    if a is None:
        out[:, 2] = (3.0 * rise / h - 2.0 * v0 - v1) / h
        out[:, 3] = (-2.0 * rise / h + v0 + v1) / h**2
        return out
    a0, a1 = a[:-1], a[1:]
    out[:, 2] = a0 / 2.0
    out[:, 3] = (20.0 * rise / h - (8.0 * v1 + 12.0 * v0) - (3.0 * a0 - a1) * h) / (2.0 * h**2)
    out[:, 4] = (-30.0 * rise / h + (14.0 * v1 + 16.0 * v0) + (3.0 * a0 - 2.0 * a1) * h) / (
        2.0 * h**3
    )
    out[:, 5] = (12.0 * rise / h - 6.0 * (v1 + v0) - (a0 - a1) * h) / (2.0 * h**4)
    return out
