"""ZMP preview control of a cart on a table.

S. Kajita et al., "Biped walking pattern generation by using preview control of zero-moment point",
ICRA 2003. The CoM is a cart of the mass m that runs on a table of the height z_c without mass; its
ZMP is p = x - z_c / g x''. The input is the CoM's jerk. A linear-quadratic regulator with an
integrator on the ZMP's error, which knows the reference within a horizon, gives

    u(k) = - G_i sum_(i <= k) (p(i) - r(i)) - G_x x(k) - sum_(j >= 1) G_d(j) r(k + j).

Both horizontal axes have the same gains, so the last axis of every array here is x and y.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from scipy.linalg import solve_discrete_are


@dataclass(frozen=True)
class CartState:
    """State of the cart and of its controller at one time.

    The controller continues from the last jerk and not from its sum of errors: the sum belongs to
    one reference, so that a plan with another future would begin with a jump of the jerk.

    Attributes:
        com: Position [m], velocity [m/s] and acceleration [m/s^2] of the CoM, (3, 2).
        jerk: Jerk in the period before, (2,) [m/s^3].
    """

    com: Array
    jerk: Array

    @classmethod
    def at_rest(cls, com: Array) -> CartState:
        """Return the state of a CoM that rests at (2,) [m]."""
        return cls(np.vstack([com, np.zeros((2, 2))]), np.zeros(2))


@dataclass(frozen=True)
class CartCourse:
    """Course of the cart at N samples.

    Attributes:
        com: Position, velocity and acceleration of the CoM, (N, 3, 2).
        jerk: Jerk in the period before each sample, (N, 2) [m/s^3].
    """

    com: Array
    jerk: Array

    def state(self, sample: int) -> CartState:
        """Return the state at a sample, from which the same course continues."""
        return CartState(self.com[sample], self.jerk[sample])


@dataclass(frozen=True)
class PreviewControl:
    """A cart with its controller.

    Attributes:
        period: Time between two samples [s].
        output: Row c that gives the ZMP of position, velocity and acceleration, (3,).
        error_gain: Gain G_i.
        state_gain: Gain G_x, (3,).
        weights: Gains G_d of the reference 1, 2, ... samples ahead, (H,).
    """

    period: float
    output: Array
    error_gain: float
    state_gain: Array
    weights: Array

    def follow(self, start: CartState, reference: Array) -> CartCourse:
        """Follow a reference of the ZMP, whose last value holds for ever.

        Args:
            start: State at the first sample.
            reference: Reference of the ZMP, (N, 2) [m].
        """
        count = len(reference)
        A, b = _cart(self.period)
        padded = np.vstack([reference, np.repeat(reference[-1:], len(self.weights), axis=0)])
        previewed = np.column_stack([
            np.correlate(column, self.weights)[: count + 1] for column in padded.T])
        # The sum of the errors with which this reference would have led to the start's jerk.
        before = np.linalg.solve(A, start.com - np.outer(b, start.jerk))
        error_sum = -(start.jerk + self.state_gain @ before + previewed[0]) / self.error_gain
        # Closed loop of error sum, position, velocity and acceleration, with the sum s of errors
        # before sample k: s(k+1) = s(k) + c x(k) - r(k), u(k) = - G_i s(k+1) - G_x x(k) - f(k).
        drive = np.concatenate([[self.error_gain], self.error_gain * self.output + self.state_gain])
        loop = np.zeros((4, 4))
        loop[0, 0], loop[0, 1:], loop[1:, 1:] = 1.0, self.output, A
        loop[1:] -= np.outer(b, drive)
        jerk_input = self.error_gain * reference - previewed[1:]
        inputs = np.concatenate([-reference[:, None], b[:, None] * jerk_input[:, None]], axis=1)
        states = np.empty((count, 4, 2))
        now = states[0] = np.vstack([error_sum, start.com])
        for k in range(count - 1):
            now = states[k + 1] = loop.dot(now) + inputs[k]
        jerk = np.vstack([start.jerk, jerk_input[:-1] - drive @ states[:-1]])
        return CartCourse(states[:, 1:], jerk)


def _cart(period: float) -> tuple[Array, Array]:
    """Transition of position, velocity and acceleration over a period, and effect of the jerk."""
    t = period
    return (np.array([[1.0, t, t * t / 2.0], [0.0, 1.0, t], [0.0, 0.0, 1.0]]),
            np.array([t**3 / 6.0, t * t / 2.0, t]))


@lru_cache(maxsize=8)
def preview_control(
    period: float, height: float, horizon: float, jerk_weight: float
) -> PreviewControl:
    """Compute the gains of preview control.

    Args:
        period: Time between two samples [s].
        height: Height z_c of the CoM above the floor [m].
        horizon: Time that the control looks ahead [s].
        jerk_weight: Weight of the squared jerk against the squared error of the ZMP [s^6].
    """
    A, b = _cart(period)
    c = np.array([1.0, 0.0, -height / GRAVITY])
    # The state of the regulator: the ZMP's error, and the differences of the cart's state.
    whole = np.zeros((4, 4))
    whole[0, 0], whole[0, 1:], whole[1:, 1:] = 1.0, c @ A, A
    inlet = np.concatenate([[c @ b], b])[:, None]
    P = solve_discrete_are(whole, inlet, np.diag([1.0, 0.0, 0.0, 0.0]), np.array([[jerk_weight]]))
    scale = jerk_weight + float((inlet.T @ P @ inlet)[0, 0])
    gains = (inlet.T @ P @ whole)[0] / scale
    closed = whole - inlet * gains
    count = round(horizon / period)
    weights = np.empty(count)
    weights[0] = -gains[0]
    ahead = -closed.T @ P[:, 0]
    for j in range(1, count):
        weights[j] = float(inlet[:, 0] @ ahead) / scale
        ahead = closed.T @ ahead
    # What lies beyond the horizon counts as equal to its end, so that a robot at rest stays so.
    weights[-1] -= gains[1] + weights.sum()
    return PreviewControl(period, c, float(gains[0]), gains[1:], weights)
