"""Many free swings of one linkage at once: eq. (1) by a fixed-step Runge-Kutta, vectorised.

Free motion depends on the ratios of the parameters to I_A alone, so the ratios are what is given.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from door_model.closer import FourBarCloser

Array = NDArray[np.float64]

STEP = 0.02  # [s]; at doors of 1 to 3 s a swing the error stays under 1e-6 rad
_LIMIT_MARGIN = 1e-4  # [rad]


@dataclass(frozen=True)
class Ratios:
    """Parameters of eq. (1) over I_A; each of shape (K,), one for each swing, or a number.

    Attributes:
        opening: c_c / I_A while the door opens [1/s].
        closing: c_c / I_A while it closes [1/s]; real closers damp closing far more.
        spring: k_c / I_A [1/s^2].
        preload: tau'_c0 / I_A [1/s^2].
    """

    opening: Array | float
    closing: Array | float
    spring: Array | float
    preload: Array | float


@dataclass(frozen=True)
class SwingBatch:
    """Swings at the nodes of the integration.

    Attributes:
        step: Time between two nodes [s].
        theta: Angles (nodes, K) [rad].
        omega: Angular velocities (nodes, K) [rad/s].
    """

    step: float
    theta: Array
    omega: Array

    def at(self, times: Array, columns: slice) -> tuple[Array, Array]:
        """Angles and velocities of some swings at times (N,) [s], by cubic Hermite polynomials.

        Returns:
            Two arrays of shape (N, number of columns).
        """
        index = np.minimum((times / self.step).astype(int), len(self.theta) - 2)
        s = (times / self.step - index)[:, None]
        p0, p1 = self.theta[index, columns], self.theta[index + 1, columns]
        m0, m1 = self.omega[index, columns], self.omega[index + 1, columns]
        rise = p1 - p0
        a = self.step * (m0 + m1) - 2.0 * rise
        b = 3.0 * rise - self.step * (2.0 * m0 + m1)
        theta = p0 + s * (self.step * m0 + s * (b + s * a))
        omega = m0 + s * (2.0 * b + 3.0 * s * a) / self.step
        return theta, omega


def integrate(
    closer: FourBarCloser,
    ratios: Ratios,
    theta0: Array,
    omega0: Array,
    duration: float,
    *,
    step: float = STEP,
) -> SwingBatch:
    """Free swings from their starts.

    Angles beyond the linkage are held at its end, so that a trial far off still gives numbers.

    Args:
        closer: The linkage.
        ratios: The ratios.
        theta0: Angles at the start (K,) [rad].
        omega0: Angular velocities at the start (K,) [rad/s].
        duration: How long at least [s].
        step: Time step [s].
    """
    lower = closer.closing_limit() + _LIMIT_MARGIN
    upper = closer.opening_limit() - _LIMIT_MARGIN

    def acceleration(theta: Array, omega: Array) -> Array:
        f, eta = closer.f_and_eta(np.clip(theta, lower, upper))
        damping = np.where(omega > 0.0, ratios.opening, ratios.closing)
        return np.asarray(-eta * (damping * eta * omega + ratios.spring * f + ratios.preload))

    nodes = max(2, int(np.ceil(duration / step - 1e-9)) + 1)
    theta = np.empty((nodes, len(theta0)))
    omega = np.empty_like(theta)
    x, v = np.array(theta0, dtype=float), np.array(omega0, dtype=float)
    theta[0], omega[0] = x, v
    half = 0.5 * step
    for node in range(1, nodes):
        a1 = acceleration(x, v)
        v2 = v + half * a1
        a2 = acceleration(x + half * v, v2)
        v3 = v + half * a2
        a3 = acceleration(x + half * v2, v3)
        v4 = v + step * a3
        a4 = acceleration(x + step * v3, v4)
        x = x + step / 6.0 * (v + 2.0 * (v2 + v3) + v4)
        v = v + step / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        theta[node], omega[node] = x, v
    return SwingBatch(step, theta, omega)
