"""Inverse kinematics of legs whose axes do not meet as `leg_ik` needs it, for many samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.errors import RobotConfigError
from numpy.typing import ArrayLike

from humanoid_motion.chain import Chain
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.leg_ik import LegGeometry, leg_geometry

_JOINTS = 6
_PARALLEL = 1e-6  # largest entry of the turn of the foot in the zero posture
_WEAKEST = 1e-3  # smallest singular value of the Jacobian in half-sitting; HRP-2 has 0.09
_REACHED = 1e-10  # largest error of a pose [m, rad]
_MOST_STEPS = 40
_LONGEST_STEP = 0.5  # of a joint, in an iteration [rad]
_DAMPING = 1e-2  # by the square of the error: none is left at the end


def leg_of(
    model: Any, side: str, joints: Sequence[str], start: Array
) -> LegGeometry | NumericalLeg:
    """Return what solves a leg: the closed form where it applies, else Newton's method.

    Args:
        model: Pinocchio's model with a free base.
        side: ``"left"`` or ``"right"``.
        joints: Names of the leg's joints, from the hip outwards.
        start: Angles of half-sitting, from which a search begins, (6,) [rad].

    Raises:
        RobotConfigError: The leg has another number of joints, or its joints do not follow each
            other from the base on.
    """
    try:
        return leg_geometry(model, side, joints)
    except RobotConfigError as error:
        above = ["root_joint", *joints]
        for name, before in zip(joints, above, strict=False):
            if str(model.names[model.parents[model.getJointId(name)]]) != before:
                raise
        if len(joints) != _JOINTS:
            raise RobotConfigError(
                f"number of joints of the {side} leg", value=len(joints), limit=_JOINTS) from error
        return NumericalLeg(f"{side} leg", model, joints, start)


class NumericalLeg:
    """A leg of six joints with any axes, solved by damped Newton steps from half-sitting.

    The steps are those of Levenberg and Marquardt, with a damping that vanishes with the error.

    Args:
        name: Name for messages, e.g. ``"right leg"``.
        model: Pinocchio's model with a free base.
        joints: Names of the joints, from the hip outwards.
        start: Angles from which the search begins, (6,) [rad]; the knee bends as it does there.

    Attributes:
        hip: Position of the third joint in base_link in the zero posture, (3,) [m].
        length: Sum of the distances between joints from there to the ankle [m].

    Raises:
        RobotConfigError: The foot is not parallel to the base in the zero posture, or the joints
            cannot move it in every direction.
    """

    def __init__(self, name: str, model: Any, joints: Sequence[str], start: Array) -> None:
        self._name, self._start = name, np.asarray(start, dtype=float)
        self._chain = Chain(model, list(joints), joints[-1])
        zero = self._chain.place(np.zeros((1, _JOINTS)), np.zeros((1, 3)))
        turned = float(np.abs(zero.rotation[0] - np.eye(3)).max())
        if turned > _PARALLEL:
            raise RobotConfigError(
                f"turn of the foot of the {name} against the base in the zero posture",
                value=round(turned, 4), limit=_PARALLEL)
        _, jacobian = self._error(self._start[None], np.zeros((1, 3)), np.eye(3)[None])
        weakest = float(np.linalg.svd(jacobian[0], compute_uv=False)[-1])
        if not weakest > _WEAKEST:
            raise RobotConfigError(
                f"the joints {', '.join(joints)} of the {name} cannot move the foot in every "
                "direction in half-sitting: smallest singular value of their Jacobian",
                value=round(weakest, 5), limit=_WEAKEST)
        self.hip = zero.origins[0, 2]
        self.length = float(np.linalg.norm(np.diff(zero.origins[0, 2:], axis=0), axis=1).sum())

    def solve(
        self, position: ArrayLike, rotation: ArrayLike | None = None, *, strict: bool = True
    ) -> Array:
        """Compute the joint angles that put the ankle's centre at given poses.

        Args:
            position: Positions of the last joint's origin in base_link, (N, 3) or (3,) [m].
            rotation: Orientations of the foot in base_link, (N, 3, 3) or (3, 3); None means that
                the foot is parallel to base_link.
            strict: Whether to raise an error if a pose is out of reach; otherwise its angles are
                NaN.

        Returns:
            Angles of the joints, (N, 6) [rad].

        Raises:
            PostureUnreachable: The leg does not reach a pose; the value is the distance of the
                ankle from the hip [m].
        """
        place = np.atleast_2d(np.asarray(position, dtype=float))
        turn = np.broadcast_to(
            np.eye(3) if rotation is None else np.asarray(rotation, dtype=float).reshape(-1, 3, 3),
            (len(place), 3, 3))
        angles = np.tile(self._start, (len(place), 1))
        open_ = np.isfinite(place).all(axis=1)
        angles[~open_] = np.nan
        for _ in range(_MOST_STEPS):
            rows = np.flatnonzero(open_)
            error, jacobian = self._error(angles[rows], place[rows], turn[rows])
            far = np.abs(error).max(axis=1, initial=0.0) > _REACHED
            open_[rows[~far]] = False
            rows, error, jacobian = rows[far], error[far], jacobian[far]
            if not len(rows):
                break
            normal = np.swapaxes(jacobian, 1, 2) @ jacobian
            damping = _DAMPING * (error**2).sum(axis=1)[:, None, None] * np.eye(_JOINTS)
            down = np.einsum("nij,ni->nj", jacobian, error)
            step = np.linalg.solve(normal + damping, down[..., None])[..., 0]
            longest = np.abs(step).max(axis=1, keepdims=True)
            angles[rows] += step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-12))
        angles[open_] = np.nan
        missed = np.isnan(angles).any(axis=1)
        if strict and missed.any():
            away = np.linalg.norm(place - self.hip, axis=1)
            worst = float(away[missed].max())
            raise PostureUnreachable(
                f"{self._name}: it does not reach a pose of the foot, {worst:.4f} m from the hip; "
                f"its links are {self.length:.4f} m long in all",
                quantity="hip to ankle [m]", value=worst, limit=self.length)
        return np.arctan2(np.sin(angles), np.cos(angles))

    def _error(self, angles: Array, place: Array, turn: Array) -> tuple[Array, Array]:
        """Return what is missing to the poses, (N, 6) [m, rad], and its Jacobian, (N, 6, 6)."""
        pose = self._chain.place(angles, np.zeros((len(angles), 3)))
        ankle = pose.origins[:, -1]
        left = turn @ np.swapaxes(pose.rotation, 1, 2)
        axis = 0.5 * np.stack([left[:, 2, 1] - left[:, 1, 2], left[:, 0, 2] - left[:, 2, 0],
                               left[:, 1, 0] - left[:, 0, 1]], axis=1)
        lever = np.cross(pose.axes, ankle[:, None] - pose.origins)
        jacobian = np.concatenate([lever, pose.axes], axis=2)
        return np.hstack([place - ankle, axis]), np.swapaxes(jacobian, 1, 2)
