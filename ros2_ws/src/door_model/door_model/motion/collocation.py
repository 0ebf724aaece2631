r"""Coefficients of collocation at Radau points, for long and exact steps of integration.

During a step of length `h` the solution is a polynomial that fulfils the differential
equation at the times `c_1 h to c_N h`; the last of them is the end of the step. This is
the implicit Runge-Kutta method Radau IIA of order `2 N - 1`, which is stable for any damping
(Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.5). All points of a step
and many motions are computed together with numpy. docs/free_motion.md derives the equations.
"""

import numpy as np
from door_impact_common.arrays import Array
from numpy.polynomial import legendre

POINTS = 7
"""Number of points of a step, N."""


def radau_points(count: int) -> Array:
    """Return the right Radau points (count,) in 0 .. 1, the roots of P_{N-1} - P_N.

    P_N is the Legendre polynomial of degree N (Hairer and Wanner, eq. (5.6)).
    """
    series = np.zeros(count + 1)
    series[count - 1 :] = 1.0, -1.0
    roots = np.sort(np.real(legendre.legroots(series)))
    points = 0.5 * (roots + 1.0)
    points[-1] = 1.0
    return np.asarray(points)


def _matrix(points: Array) -> Array:
    """Return integrals (N, N) from 0 to each point of the polynomials that are 1 at one point."""
    x = 2.0 * points - 1.0
    count = len(points)
    values = legendre.legvander(x, count - 1)
    integrals = np.empty((count, count))
    for degree in range(count):
        unit = np.zeros(degree + 1)
        unit[degree] = 0.5
        integrals[:, degree] = legendre.legval(x, legendre.legint(unit, lbnd=-1.0))
    return np.asarray(np.linalg.solve(values.T, integrals.T).T)


NODES = radau_points(POINTS)
"""Points of a step as shares of its length, c (N,)."""

MATRIX = _matrix(NODES)
"""Runge-Kutta matrix A (N, N)."""

ROUGHNESS = np.linalg.inv(legendre.legvander(2.0 * NODES - 1.0, POINTS - 1))[-1]
"""Weights (N,) of the values at the points in the highest Legendre coefficient."""

_KNOTS = np.concatenate([[0.0], NODES])
_WEIGHTS = 1.0 / np.prod(_KNOTS[:, None] - _KNOTS + np.eye(POINTS + 1), axis=1)


def interpolation(c: Array) -> Array:
    """Return the weights (M, N + 1) of start and points in a step's polynomial.

    They follow from the barycentric formula (Berrut and Trefethen, SIAM Review 46, 2004).

    Args:
        c: Times at which the polynomial is evaluated, as shares of the step (M,).
    """
    away = c[:, None] - _KNOTS
    hit = np.abs(away) < 1e-14
    shares = _WEIGHTS / np.where(hit, 1.0, away)
    rows = shares / shares.sum(axis=1, keepdims=True)
    at_knot = hit.any(axis=1)
    rows[at_knot] = hit[at_knot]
    return np.asarray(rows)
