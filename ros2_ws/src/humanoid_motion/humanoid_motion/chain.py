"""Kinematics of a chain of joints for many samples at once.

Pinocchio computes one posture per call, which is slow for the thousands of samples of a plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.errors import RobotConfigError

_UNIT = 1e-6  # largest deviation of a unit vector's length


@dataclass(frozen=True)
class ChainPose:
    """Pose of a chain of C joints in odom, at N samples.

    Attributes:
        axes: Unit vectors along the axes of the joints, (N, C, 3).
        origins: Points on the axes, (N, C, 3) [m].
        end: Origin of the frame at the chain's end, (N, 3) [m].
        rotation: Orientation of the last joint's frame, (N, 3, 3).
    """

    axes: Array
    origins: Array
    end: Array
    rotation: Array

    def jacobian(self) -> Array:
        """Compute the Jacobian of the end's position with respect to the joints, (N, 3, C) [m]."""
        return np.swapaxes(np.cross(self.axes, self.end[:, None] - self.origins), 1, 2)

    def torques(self, force: Array, moment: Array) -> Array:
        """Compute the torques at the joints of a force and a moment at the end, (N, C) [N m].

        Args:
            force: Force on the end, axes of odom, (N, 3) [N].
            moment: Moment on the end, axes of odom, (N, 3) [N m].
        """
        arm = np.cross(self.end[:, None] - self.origins, force[:, None])
        return np.einsum("ncj,ncj->nc", self.axes, arm + moment[:, None])


class Chain:
    """The joints from base_link to a frame.

    Args:
        model: Pinocchio's model, with a free joint first.
        joint_names: Names of the robot's joints in its own order.
        frame: Name of the frame at the chain's end.

    Attributes:
        columns: Columns of the chain's joints in the robot's order, from the base outwards, (C,).

    Raises:
        RobotConfigError: A joint has no axis.
    """

    def __init__(self, model: Any, joint_names: Sequence[str], frame: str) -> None:
        end = model.frames[model.getFrameId(frame)]
        joints: list[int] = []
        joint = int(end.parentJoint)
        while joint > 1:  # 0 is the universe, 1 the free joint of the base
            joints.insert(0, joint)
            joint = int(model.parents[joint])
        self.columns = np.array([joint_names.index(model.names[j]) for j in joints])
        self._offsets = [np.array(model.jointPlacements[j].translation) for j in joints]
        turned = [np.array(model.jointPlacements[j].rotation) for j in joints]
        self._turned = [None if np.array_equal(turn, np.eye(3)) else turn for turn in turned]
        self._axes = [_axis(model.joints[j]) for j in joints]
        self._skews = [np.array(pin.skew(axis)) for axis in self._axes]
        self._end = np.array(end.placement.translation)

    def place(self, joints: Array, base: Array, base_yaw: Array | None = None) -> ChainPose:
        """Compute the pose of the chain on an upright base_link.

        Args:
            joints: Joints in the robot's order, (N, J) [rad].
            base: Positions of base_link in odom, (N, 3) [m].
            base_yaw: Headings of base_link, (N,) [rad]; None means parallel to odom.
        """
        n, count = len(joints), len(self.columns)
        axes, origins = np.empty((n, count, 3)), np.empty((n, count, 3))
        angle = joints[:, self.columns]
        sine, versed = np.sin(angle)[:, :, None, None], (1.0 - np.cos(angle))[:, :, None, None]
        rotation = np.tile(np.eye(3), (n, 1, 1)) if base_yaw is None else yaw_matrices(base_yaw)
        place = np.asarray(base, dtype=float)
        for i, (turned, axis, skew) in enumerate(
            zip(self._turned, self._axes, self._skews, strict=True)
        ):
            place = place + _times(rotation, self._offsets[i])
            if turned is not None:
                rotation = _times(rotation, turned)
            axes[:, i], origins[:, i] = _times(rotation, axis), place
            across = _times(rotation, skew)  # Rodrigues' formula
            rotation = rotation + sine[:, i] * across + versed[:, i] * _times(across, skew)
        return ChainPose(axes, origins, place + _times(rotation, self._end), rotation)


def yaw_matrices(angle: Array) -> Array:
    """Compute the rotation matrices (N, 3, 3) of turns about z by angles (N,) [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    out = np.zeros((len(cos), 3, 3))
    out[:, 0, 0], out[:, 0, 1], out[:, 1, 0], out[:, 1, 1] = cos, -sin, sin, cos
    out[:, 2, 2] = 1.0
    return out


def _axis(joint: Any) -> Array:
    """Return the axis of a revolute joint in its own frame, (3,)."""
    axis = np.array(joint.createData().S).reshape(6)[3:]
    length = float(np.linalg.norm(axis))
    if not abs(length - 1.0) <= _UNIT:
        raise RobotConfigError("length of a joint's axis in the URDF", value=length, limit=1)
    return axis


def _times(matrices: Array, constant: Array) -> Array:
    """Multiply matrices (N, 3, 3) with one matrix or vector, in one product for speed."""
    return (matrices.reshape(-1, 3) @ constant).reshape(len(matrices), *constant.shape)
