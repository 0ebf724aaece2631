"""Rotations and vectors of a few samples at a time, quicker than NumPy's general functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hrp2_sim_bridge.spline import Array


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


def rotation(quaternion: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4) x, y, z, w."""
    given = np.asarray(quaternion, dtype=float)
    x, y, z, w = given[..., 0], given[..., 1], given[..., 2], given[..., 3]
    out = np.empty((*x.shape, 3, 3))
    out[..., 0, 0] = 1 - 2 * (y * y + z * z)
    out[..., 0, 1] = 2 * (x * y - z * w)
    out[..., 0, 2] = 2 * (x * z + y * w)
    out[..., 1, 0] = 2 * (x * y + z * w)
    out[..., 1, 1] = 1 - 2 * (x * x + z * z)
    out[..., 1, 2] = 2 * (y * z - x * w)
    out[..., 2, 0] = 2 * (x * z - y * w)
    out[..., 2, 1] = 2 * (y * z + x * w)
    out[..., 2, 2] = 1 - 2 * (x * x + y * y)
    return out


def cross(a: Array, b: Array) -> Array:
    """Cross product of vectors (..., 3)."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    out = np.empty(a.shape)
    out[..., 0] = ay * bz - az * by
    out[..., 1] = az * bx - ax * bz
    out[..., 2] = ax * by - ay * bx
    return out


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
