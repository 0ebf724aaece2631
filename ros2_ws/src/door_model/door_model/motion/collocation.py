r"""Collocation at Radau points: the numbers of a method that steps far and exactly.

A step of length :math:`h` is a polynomial that fulfils the differential equation at the points
:math:`c_1 \dots c_N h`, the last at the end of the step. It is the implicit Runge-Kutta method
Radau IIA of order :math:`2 N - 1`, stable for any damping (Hairer and Wanner, Solving Ordinary
Differential Equations II, section IV.5). All points of a step, and of many motions at once, are
worked out together, which suits numpy.
"""

import numpy as np
from door_impact_common.arrays import Array
from numpy.polynomial import legendre

POINTS = 7


def radau_points(count: int) -> Array:
    """Right Radau points (count,) on 0 .. 1: roots of P_{N-1} - P_N, Hairer and Wanner (5.6)."""
    series = np.zeros(count + 1)
    series[count - 1 :] = 1.0, -1.0
    roots = np.sort(np.real(legendre.legroots(series)))
    points = 0.5 * (roots + 1.0)
    points[-1] = 1.0
    return np.asarray(points)


def _matrix(points: Array) -> Array:
    """Integrals (N, N) from 0 to each point of the polynomial that is 1 at one point alone."""
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
"""Points of a step, (N,)."""

MATRIX = _matrix(NODES)
"""Runge-Kutta matrix, (N, N)."""

ROUGHNESS = np.linalg.inv(legendre.legvander(2.0 * NODES - 1.0, POINTS - 1))[-1]
"""Weights (N,) that give the highest Legendre coefficient of a polynomial through the points."""

_KNOTS = np.concatenate([[0.0], NODES])
_WEIGHTS = 1.0 / np.prod(_KNOTS[:, None] - _KNOTS + np.eye(POINTS + 1), axis=1)


def interpolation(c: Array) -> Array:
    """Weights (M, N + 1) of start and points that give a step's polynomial at places c (M,).

    By the barycentric formula (Berrut and Trefethen, SIAM Review 46, 2004).
    """
    away = c[:, None] - _KNOTS
    hit = np.abs(away) < 1e-14
    shares = _WEIGHTS / np.where(hit, 1.0, away)
    rows = shares / shares.sum(axis=1, keepdims=True)
    at_knot = hit.any(axis=1)
    rows[at_knot] = hit[at_knot]
    return np.asarray(rows)
