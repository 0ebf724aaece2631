"""Closed-form inverse kinematics of a humanoid's legs, for many samples at once.

The three hip axes (z, x, y) intersect, and so do the ankle axes (y, x). Between hip and ankle
the leg may step sideways (HRP-2's does, at the knee), which is why the ankle roll is not simply
the slope of the line from the ankle to the hip.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

from humanoid_motion.errors import PostureUnreachable


@dataclass(frozen=True)
class LegGeometry:
    """Dimensions of a leg, read from the URDF by `RobotModel`.

    Attributes:
        name: For messages, e.g. ``"right leg"``.
        hip: Position of the hip centre in base_link, (3,) [m].
        thigh: Hip to knee [m].
        shank: Knee to ankle along the shank [m].
        lateral: Hip to ankle along y, with all angles zero [m]; HRP-2's right leg: negative.
    """

    name: str
    hip: Array
    thigh: float
    shank: float
    lateral: float


def leg_ik(
    geometry: LegGeometry,
    position: ArrayLike,
    rotation: ArrayLike | None = None,
    *,
    strict: bool = True,
) -> Array:
    """Joint angles that put the ankle at given poses.

    Args:
        geometry: The leg.
        position: Ankle centre in base_link, (N, 3) or (3,) [m].
        rotation: Orientation of the foot in base_link, (N, 3, 3) or (3, 3); None: parallel.
        strict: Raise where a pose is out of reach; else its angles are NaN.

    Returns:
        (N, 6): hip yaw, roll, pitch, knee, ankle pitch, roll [rad], knee bent forwards.

    Raises:
        PostureUnreachable: The ankle is further from the hip than the stretched leg, or nearer
            than the folded one; value and limit are the distances [m].
    """
    p = np.atleast_2d(np.asarray(position, dtype=float))
    foot = None if rotation is None else np.asarray(rotation, dtype=float).reshape(-1, 3, 3)
    # From the ankle to the hip, in the foot's frame.
    r = geometry.hip - p
    if foot is not None:
        r = np.einsum("nji,nj->ni", np.broadcast_to(foot, (len(p), 3, 3)), r)
    rho2 = r[:, 1] ** 2 + r[:, 2] ** 2
    a, b, o = geometry.thigh, geometry.shank, geometry.lateral
    length2 = r[:, 0] ** 2 + rho2 - o**2
    within = (length2 <= (a + b) ** 2) & (length2 > (a - b) ** 2) & (rho2 > o**2)
    if not within.all():
        if strict:
            _raise_unreached(geometry, length2)
        r, rho2, length2 = (
            np.where(within if part.ndim == 1 else within[:, None], part, np.nan)
            for part in (r, rho2, length2))

    ankle_roll = np.arctan2(r[:, 1], r[:, 2]) + np.arcsin(o / np.sqrt(rho2))
    knee = np.arccos((length2 - a**2 - b**2) / (2.0 * a * b))
    slope = np.arctan2(-r[:, 0], np.sqrt(rho2 - o**2))
    ankle_pitch = slope - np.arctan2(a * np.sin(knee), b + a * np.cos(knee))
    if foot is None:
        return np.column_stack([
            np.zeros_like(knee), -ankle_roll, -(knee + ankle_pitch), knee, ankle_pitch, ankle_roll])
    hip = foot @ _rot_x(-ankle_roll) @ _rot_y(-(knee + ankle_pitch))
    return np.column_stack(
        [
            np.arctan2(-hip[:, 0, 1], hip[:, 1, 1]),
            np.arcsin(np.clip(hip[:, 2, 1], -1.0, 1.0)),
            np.arctan2(-hip[:, 2, 0], hip[:, 2, 2]),
            knee,
            ankle_pitch,
            ankle_roll,
        ]
    )


def _raise_unreached(geometry: LegGeometry, length2: Array) -> NoReturn:
    """Name the worst of the poses of which one is out of reach."""
    a, b = geometry.thigh, geometry.shank
    longest, shortest = a + b, abs(a - b)
    worst = int(np.argmax(length2))
    if not np.all(np.isfinite(length2)):
        raise PostureUnreachable(
            f"{geometry.name}: the foot's pose is not a number",
            quantity="hip to ankle [m]",
            value=float("nan"),
            limit=longest,
        )
    if length2[worst] > longest**2:
        value = float(np.sqrt(length2[worst]))
        raise PostureUnreachable(
            f"{geometry.name}: hip and ankle would be {value:.4f} m apart, "
            f"stretched it reaches {longest:.4f} m",
            quantity="hip to ankle [m]",
            value=value,
            limit=longest,
        )
    value = float(np.sqrt(max(float(np.min(length2)), 0.0)))
    raise PostureUnreachable(
        f"{geometry.name}: hip and ankle would be {value:.4f} m apart, "
        f"folded they keep at least {shortest:.4f} m",
        quantity="hip to ankle [m]",
        value=value,
        limit=shortest,
    )


def _rot_x(angle: Array) -> Array:
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    return np.stack([one, zero, zero, zero, c, -s, zero, s, c], axis=-1).reshape(-1, 3, 3)


def _rot_y(angle: Array) -> Array:
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    return np.stack([c, zero, s, zero, one, zero, -s, zero, c], axis=-1).reshape(-1, 3, 3)
