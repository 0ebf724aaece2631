"""Rotations and vectors of a few samples at a time, quicker than NumPy's general functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class BodyState:
    """Pose and velocity of a frame, in the world.

    Attributes:
        position: (..., 3) [m].
        quaternion: (..., 4) x, y, z, w.
        linear: (..., 3) velocity of the frame's origin [m/s].
        angular: (..., 3) [rad/s].
    """

    position: Array
    quaternion: Array
    linear: Array
    angular: Array

    def at(self, index: Any) -> BodyState:
        """The states at an index of the leading axes."""
        return BodyState(
            self.position[index], self.quaternion[index], self.linear[index], self.angular[index]
        )


def _rotation_form() -> Array:
    """(16, 9): takes the products of a quaternion's entries to those of its matrix."""
    form = np.zeros((4, 4, 3, 3))
    w = 3
    for i in range(3):
        form[w, w, i, i] += 1.0
        for j in range(3):
            form[j, j, i, i] -= 1.0
            form[i, j, i, j] += 2.0
            for k in range(3):
                # 2 w (v x .): the entry (i, j) is -epsilon_ijk v_k
                form[w, k, i, j] -= 2.0 * _PERMUTATION[i, j, k]
    return form.reshape(16, 9)


_PERMUTATION = np.array(
    [[[(i - j) * (j - k) * (k - i) / 2.0 for k in range(3)] for j in range(3)] for i in range(3)]
)
_CROSS_FORM = _PERMUTATION.transpose(1, 2, 0).reshape(9, 3)
_ROTATION_FORM = _rotation_form()


def rotation(quaternion: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4) x, y, z, w."""
    q = np.asarray(quaternion, dtype=float)
    products = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    return np.asarray((products @ _ROTATION_FORM).reshape(*q.shape[:-1], 3, 3))


def cross(a: Array, b: Array) -> Array:
    """Cross product of vectors (..., 3)."""
    products = (a[..., :, None] * b[..., None, :]).reshape(*a.shape[:-1], 9)
    return np.asarray(products @ _CROSS_FORM)


def into_frame(turn: Array, vector: Array) -> Array:
    """Components of world vectors (..., 3) in frames turned by (..., 3, 3)."""
    return np.asarray((vector[..., None, :] @ turn)[..., 0, :])


def quaternion_product(p: Sequence[Any], q: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Product of two quaternions x, y, z, w, each of four numbers or of four arrays."""
    x, y, z, w = p
    a, b, c, d = q
    return (
        w * a + x * d + y * c - z * b,
        w * b + y * d + z * a - x * c,
        w * c + z * d + x * b - y * a,
        w * d - x * a - y * b - z * c,
    )
