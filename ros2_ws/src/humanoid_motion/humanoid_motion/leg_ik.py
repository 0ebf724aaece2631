"""Closed-form inverse kinematics of a humanoid's legs, for many samples at once.

The three hip axes (yaw about z, roll about x, pitch about y) meet in one point, and so do the two
ankle axes (pitch about y, roll about x). Between hip and ankle the leg may have a lateral offset,
as HRP-2's knee has; therefore the ankle's roll is not simply the slope of the line from the ankle
to the hip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.errors import RobotConfigError
from numpy.typing import ArrayLike

from humanoid_motion.errors import PostureUnreachable

_BELOW = "yz"  # axes along which a knee or an ankle may be displaced; along z only downwards
# The joints of a leg that `leg_ik` solves, from the hip outwards: name, axis of rotation, and the
# axes along which the joint may be displaced from the one before it.
_LEG_KIND = (
    ("hip yaw", "RZ", "xyz"), ("hip roll", "RX", ""), ("hip pitch", "RY", ""),
    ("knee", "RY", _BELOW), ("ankle pitch", "RY", _BELOW), ("ankle roll", "RX", ""),
)  # fmt: skip
_PARALLEL = 1e-6  # largest deviation of offsets [m] and of the entries of a rotation matrix


@dataclass(frozen=True)
class LegGeometry:
    """Dimensions of a leg.

    Attributes:
        name: Name for messages, e.g. ``"right leg"``.
        hip: Position of the hip's centre in base_link, (3,) [m].
        thigh: Distance from the hip to the knee along z, with all angles zero [m].
        shank: Distance from the knee to the ankle along z, with all angles zero [m].
        lateral: Offset of the ankle from the hip along y, with all angles zero [m]; negative for
            HRP-2's right leg.
    """

    name: str
    hip: Array
    thigh: float
    shank: float
    lateral: float

    @property
    def length(self) -> float:
        """Distance from the hip to the ankle along z with a stretched knee [m]."""
        return self.thigh + self.shank

    def solve(
        self, position: ArrayLike, rotation: ArrayLike | None = None, *, strict: bool = True
    ) -> Array:
        """Compute the joint angles; arguments, result and errors are those of `leg_ik`."""
        return leg_ik(self, position, rotation, strict=strict)


def is_parallel(placement: Any) -> bool:
    """Whether a placement of Pinocchio (SE3) does not turn its frame."""
    return bool(np.abs(placement.rotation - np.eye(3)).max() < _PARALLEL)


def leg_geometry(model: Any, side: str, joints: Sequence[str]) -> LegGeometry:
    """Read the dimensions of a leg, and check that `leg_ik` can solve it.

    Args:
        model: Pinocchio's model with a free base.
        side: ``"left"`` or ``"right"``.
        joints: Names of the leg's six joints, from the hip outwards.

    Raises:
        RobotConfigError: An axis or an offset of a joint is not of the kind that `leg_ik` solves.
    """
    names = ["root_joint", *joints]
    offset = [_leg_offset(model, i, names[i + 1], names[i]) for i in range(len(_LEG_KIND))]
    return LegGeometry(
        name=f"{side} leg",
        hip=offset[0],
        thigh=float(-offset[3][2]),
        shank=float(-offset[4][2]),
        lateral=float(offset[3][1] + offset[4][1]),
    )


def _leg_offset(model: Any, place: int, name: str, before: str) -> Array:
    """Read a leg joint's place in the joint before it, (3,) [m], and check it by `_LEG_KIND`."""
    what, axis, free = _LEG_KIND[place]

    def require(fits: bool, quantity: str, value: object, limit: str) -> None:
        if not fits:
            raise RobotConfigError(
                f"{name} is not the {what} of a leg that the planner solves: {quantity}",
                value=value,
                limit=limit,
            )

    index = model.getJointId(name)
    parent = str(model.names[model.parents[index]])
    require(parent == before, "joint before it", parent, before)
    kind = str(model.joints[index].shortname())
    require(kind == f"JointModel{axis}", "axis", kind, f"JointModel{axis}")
    placement = model.jointPlacements[index]
    require(
        is_parallel(placement), "frame in the zero posture",
        np.round(placement.rotation, 3).tolist(), "parallel to the base",
    )  # fmt: skip
    offset = np.array(placement.translation)
    aside = [abs(x) for x, letter in zip(offset, "xyz", strict=True) if letter not in free]
    require(
        max(aside, default=0.0) < _PARALLEL and (free != _BELOW or offset[2] < 0.0),
        "offset [m]", offset.round(4).tolist(), f"along {free or 'no axis'} only, not upwards",
    )  # fmt: skip
    return offset


def leg_ik(
    geometry: LegGeometry,
    position: ArrayLike,
    rotation: ArrayLike | None = None,
    *,
    strict: bool = True,
) -> Array:
    """Compute the joint angles that put the ankle at given poses.

    Args:
        geometry: Dimensions of the leg.
        position: Positions of the ankle's centre in base_link, (N, 3) or (3,) [m].
        rotation: Orientations of the foot in base_link, (N, 3, 3) or (3, 3); None means that the
            foot is parallel to base_link.
        strict: Whether to raise an error if a pose is out of reach; otherwise its angles are NaN.

    Returns:
        Angles of hip yaw, hip roll, hip pitch, knee, ankle pitch and ankle roll, (N, 6) [rad], with
        the knee bent forwards.

    Raises:
        PostureUnreachable: The ankle is further from the hip than the length of the stretched leg,
            or nearer than the folded leg allows; value and limit are these distances [m].
    """
    p = np.atleast_2d(np.asarray(position, dtype=float))
    foot = None if rotation is None else np.asarray(rotation, dtype=float).reshape(-1, 3, 3)
    # r points from the ankle to the hip, in the foot's axes.
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
    hip = np.broadcast_to(foot, (len(p), 3, 3)) @ _rot_xy(-ankle_roll, -(knee + ankle_pitch))
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
    """Raise the error for the pose that is furthest out of reach."""
    longest, shortest = geometry.thigh + geometry.shank, abs(geometry.thigh - geometry.shank)
    value, limit = float(np.sqrt(max(float(np.max(length2)), 0.0))), longest
    what = f"the stretched leg reaches {longest:.4f} m"
    if not value > longest:  # also NaN
        value, limit = float(np.sqrt(max(float(np.min(length2)), 0.0))), shortest
        what = f"the folded leg keeps at least {shortest:.4f} m"
    what = f"hip and ankle would be {value:.4f} m apart, {what}"
    if not np.all(np.isfinite(length2)):
        value, limit = float("nan"), longest
        what = "the foot's pose is not a number, check what it is computed from"
    raise PostureUnreachable(
        f"{geometry.name}: {what}", quantity="hip to ankle [m]", value=value, limit=limit)


def _rot_xy(roll: Array, pitch: Array) -> Array:
    """Compute the matrices (N, 3, 3) of turns by pitch about y and then by roll about x."""
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    out = np.empty((len(roll), 3, 3))
    out[:, 0, 0], out[:, 0, 1], out[:, 0, 2] = cp, 0.0, sp
    out[:, 1, 0], out[:, 1, 1], out[:, 1, 2] = sr * sp, cr, -sr * cp
    out[:, 2, 0], out[:, 2, 1], out[:, 2, 2] = -cr * sp, sr, cr * cp
    return out
