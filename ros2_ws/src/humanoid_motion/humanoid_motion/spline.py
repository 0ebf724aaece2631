"""The motion that a driver makes of the points of a joint trajectory.

`Spline` follows any trajectory message as ros2_control's JointTrajectoryController does, and rests
outside its points. `humanoid_motion.knots` holds planned motions, and says why the quintic is
written in both modules.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

_DEGREE = 5  # highest degree of the polynomials
_POWERS = np.arange(_DEGREE + 1)


@dataclass(frozen=True)
class JointReference:
    """Reference state of all N joints at one time.

    Attributes:
        position: Positions, (N,) [rad].
        velocity: Velocities, (N,) [rad/s].
        acceleration: Accelerations, (N,) [rad/s^2].
    """

    position: Array
    velocity: Array
    acceleration: Array


class Spline:
    """Motion of N joints through K knots, with a polynomial between each two successive knots.

    The polynomials are straight lines if the knots have positions only, cubics if the knots also
    have velocities, and quintics if they have accelerations too. Before the first knot the joints
    rest at the first knot, after the last knot they rest at the last knot.

    Args:
        times: Times of the knots, strictly increasing, (K,) with K >= 1 [s].
        position: Positions, (K, N) [rad].
        velocity: Velocities, (K, N) [rad/s], or None.
        acceleration: Accelerations, (K, N) [rad/s^2], or None; they need velocities.

    Attributes:
        times: Times of the knots, (K,) [s].
        position: Positions at the knots, (K, N) [rad].
        coefficients: Coefficients of the polynomials in the time since the start of their
            segment, (K-1, 6, N).
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

    def sample(self, time: float) -> JointReference:
        """Compute the state at a time [s]; from the last knot's time on, the joints are at rest."""
        segment = bisect_right(self._starts, time) - 1
        if segment < 0 or segment >= len(self.coefficients):
            rest = self.position[0 if segment < 0 else -1]
            return JointReference(rest, np.zeros_like(rest), np.zeros_like(rest))
        state = _basis(time - self._starts[segment]) @ self.coefficients[segment]
        return JointReference(state[0], state[1], state[2])

    def positions(self, times: Array) -> Array:
        """Compute the positions (T, N) [rad] that `sample` returns at times (T,) [s]."""
        segment = np.searchsorted(self.times, times, side="right") - 1
        out = self.position[np.where(segment < 0, 0, -1)]
        inside = (segment >= 0) & (segment < len(self.coefficients))
        if inside.any():
            segment = segment[inside]
            powers = (times[inside] - self.times[segment])[:, None] ** _POWERS
            out[inside] = (powers[:, None, :] @ self.coefficients[segment])[:, 0]
        return out

    def end_state(self) -> JointReference:
        """Compute the state in which the last segment arrives at the last knot."""
        if not len(self.coefficients):
            return self.sample(self.end)
        state = _basis(self._starts[-1] - self._starts[-2]) @ self.coefficients[-1]
        return JointReference(state[0], state[1], state[2])

    def inner_states(self, per_segment: int) -> tuple[Array, Array, Array]:
        """Compute states spread evenly over each segment, for checks of the whole motion.

        Args:
            per_segment: Number S of samples in each segment, both ends included.

        Returns:
            Times ((K-1)*S,) [s], positions ((K-1)*S, N) [rad] and velocities ((K-1)*S, N) [rad/s].
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
    """Rows (3, 6) that make position, velocity and acceleration of the coefficients, at t [s]."""
    t2, t3, t4 = t * t, t * t * t, t * t * t * t
    return np.array(
        [
            [1.0, t, t2, t3, t4, t4 * t],
            [0.0, 1.0, 2.0 * t, 3.0 * t2, 4.0 * t3, 5.0 * t4],
            [0.0, 0.0, 2.0, 6.0 * t, 12.0 * t2, 20.0 * t3],
        ]
    )


def _coefficients(times: Array, q: Array, v: Array | None, a: Array | None) -> Array:
    """Coefficients of each segment's polynomial in the time since its start, (K-1, 6, N)."""
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
