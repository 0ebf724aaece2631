"""The motion that a driver makes of the points of a joint trajectory.

`Spline` follows any trajectory message as ros2_control's JointTrajectoryController does, and rests
outside its points. Planned motions (`humanoid_motion.knots`) are evaluated with it, too.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

# Coefficients of a quintic on [0, 1] from value, first and second derivative at 0 and at 1.
_QUINTIC = np.array([
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
    [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
    [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
    [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
])
# Value and two derivatives of a quintic: factors and powers of x that its coefficients have.
_FACTORS = np.array([[1, 1, 1, 1, 1, 1], [0, 1, 2, 3, 4, 5], [0, 0, 2, 6, 12, 20]])
_POWERS = np.array([[0, 1, 2, 3, 4, 5], [0, 0, 1, 2, 3, 4], [0, 0, 0, 1, 2, 3]])


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
        if not 0 <= segment < len(self.coefficients):
            rest = self.position[0 if segment < 0 else -1]
            return JointReference(rest, np.zeros_like(rest), np.zeros_like(rest))
        return JointReference(*evaluate(self.coefficients[segment], time - self._starts[segment]))

    def states(self, times: Array) -> tuple[Array, Array, Array]:
        """Compute positions, velocities and accelerations (T, N) at times (T,) [s].

        Times outside the knots count as the nearest knot's, where the joints may still move.
        """
        if not len(self.coefficients):
            rest = np.repeat(self.position, len(times), axis=0)
            return rest, np.zeros_like(rest), np.zeros_like(rest)
        segment = np.searchsorted(self.times[1:-1], times, side="right")
        local = np.clip(times, self.times[0], self.times[-1]) - self.times[segment]
        return evaluate(self.coefficients[segment], local)

    def positions(self, times: Array) -> Array:
        """Compute the positions (T, N) [rad] that `sample` returns at times (T,) [s]."""
        return self.states(times)[0]

    def end_state(self) -> JointReference:
        """Compute the state in which the last segment arrives at the last knot."""
        return JointReference(*(rows[0] for rows in self.states(self.times[-1:])))

    def inner_states(self, per_segment: int) -> tuple[Array, Array, Array]:
        """Compute states spread evenly over each segment, for checks of the whole motion.

        Args:
            per_segment: Number S of samples in each segment, both ends included.

        Returns:
            Times ((K-1)*S,) [s], positions ((K-1)*S, N) [rad] and velocities ((K-1)*S, N) [rad/s].
        """
        local = np.diff(self.times)[:, None] * np.linspace(0.0, 1.0, per_segment)
        position, velocity, _ = evaluate(self.coefficients[:, None], local)
        count = self.position.shape[1]
        times = (self.times[:-1, None] + local).ravel()
        return times, position.reshape(-1, count), velocity.reshape(-1, count)


def quintic(*ends: Array) -> Array:
    """Compute the quintic on [0, 1] that has given values and derivatives at both ends.

    Args:
        ends: Value, first and second derivative at 0, then the same three at 1; six arrays (...).

    Returns:
        Coefficients of the powers 0 to 5, (6, ...).
    """
    stacked = np.array(ends)
    return np.asarray((_QUINTIC @ stacked.reshape(6, -1)).reshape(stacked.shape))


def evaluate(coefficients: Array, x: float | Array) -> tuple[Array, Array, Array]:
    """Compute quintics and their first two derivatives.

    Args:
        coefficients: Coefficients of the powers 0 to 5 of M quintics, (..., 6, M).
        x: Where to evaluate them, (...).

    Returns:
        Values, first and second derivatives, (..., M) each.
    """
    rows = _FACTORS * np.asarray(x, dtype=float)[..., None, None] ** _POWERS
    found = rows @ coefficients
    return found[..., 0, :], found[..., 1, :], found[..., 2, :]


def _coefficients(times: Array, q: Array, v: Array | None, a: Array | None) -> Array:
    """Compute each segment's polynomial in the time since its start, (K-1, 6, N)."""
    h = np.diff(times)[:, None]
    out = np.zeros((len(times) - 1, 6, q.shape[1]))
    rise = np.diff(q, axis=0)
    out[:, 0] = q[:-1]
    if v is None:
        out[:, 1] = rise / h
    elif a is None:
        out[:, 1] = v[:-1]
        out[:, 2] = (3.0 * rise / h - 2.0 * v[:-1] - v[1:]) / h
        out[:, 3] = (-2.0 * rise / h + v[:-1] + v[1:]) / h**2
    elif len(rise):
        ends = (rows for end in (slice(0, -1), slice(1, None))
                for rows in (q[end], v[end] * h, a[end] * h**2))
        for power, rows in enumerate(quintic(*ends)):
            out[:, power] = rows / h**power
    return out
