"""Rotations and cross products of a few samples, faster than NumPy's and SciPy's functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

# Axes in cyclic order: the third is the cross product of the first two.
_CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]  # for each axis, the two that follow it


def _rotation_form() -> Array:
    """Return the matrix (16, 9) that maps products of a quaternion's entries to its rotation."""
    form = np.zeros((4, 4, 3, 3))
    w = 3  # index of the scalar part
    for i in range(3):
        form[w, w, i, i] += 1.0
        for j in range(3):
            form[j, j, i, i] -= 1.0
            form[i, j, i, j] += 2.0
    for i, j, k in _CYCLES:
        form[w, k, i, j] -= 2.0
        form[w, k, j, i] += 2.0
    return form.reshape(16, 9)


_ROTATION_FORM = _rotation_form()


def rotation(quaternion: ArrayLike) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions x, y, z, w (..., 4)."""
    q = np.asarray(quaternion, dtype=float)
    products = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    return np.asarray((products @ _ROTATION_FORM).reshape(*q.shape[:-1], 3, 3))


def cross(a: Array, b: Array) -> Array:
    """Return the cross products of vectors (..., 3)."""
    if a.ndim == b.ndim == 1:  # plain floats are faster than arrays of three numbers
        (x, y, z), (u, v, w) = a.tolist(), b.tolist()
        return np.array([y * w - z * v, z * u - x * w, x * v - y * u])
    return np.asarray(a[..., _NEXT] * b[..., _AFTER] - a[..., _AFTER] * b[..., _NEXT])


def into_frame(turn: Array, vector: Array) -> Array:
    """Return the components of world vectors (..., 3) in frames with rotations (..., 3, 3)."""
    return np.asarray((vector[..., None, :] @ turn)[..., 0, :])


def quaternion_product(p: Sequence[Any], q: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Return the product of two quaternions x, y, z, w, each of four numbers or four arrays."""
    x, y, z, w = p
    a, b, c, d = q
    return (
        w * a + x * d + y * c - z * b,
        w * b + y * d + z * a - x * c,
        w * c + z * d + x * b - y * a,
        w * d - x * a - y * b - z * c)
