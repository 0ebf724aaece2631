"""Kinematics of a chain of joints for many samples at once.

Pinocchio answers for one posture a call; a plan has thousands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STRAIGHT = np.eye(3)


@dataclass(frozen=True)
class ChainPose:
    """Where the chain is, in odom.

    Attributes:
        axes: Of the C joints, (N, C, 3).
        origins: Points on the axes, (N, C, 3) [m].
        end: Origin of the frame at the end, (N, 3) [m].
    """

    axes: Array
    origins: Array
    end: Array

    def jacobian(self) -> Array:
        """Of the end's position to the joints, (N, 3, C) [m]."""
        return np.swapaxes(np.cross(self.axes, self.end[:, None] - self.origins), 1, 2)

    def torques(self, force: Array, moment: Array) -> Array:
        """What a force and a moment at the end (N, 3) do at the joints, (N, C) [N m]."""
        arm = np.cross(self.end[:, None] - self.origins, force[:, None])
        return np.einsum("ncj,ncj->nc", self.axes, arm + moment[:, None])


class Chain:
    """The joints from base_link to a frame.

    Args:
        model: Pinocchio's model, with a free joint first.
        joint_names: The robot's joints in its own order.
        frame: Name of the frame at the end.

    Attributes:
        columns: Of its joints in the robot's order, from the base outwards, (C,).
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
        self._turned = [np.array(model.jointPlacements[j].rotation) for j in joints]
        self._axes = [_axis(model.joints[j]) for j in joints]
        self._end = np.array(end.placement.translation)

    def place(self, joints: Array, base: Array) -> ChainPose:
        """Pose for joints (N, J) [rad] and an upright base_link at places (N, 3) [m]."""
        n, count = len(joints), len(self.columns)
        axes, origins = np.empty((n, count, 3)), np.empty((n, count, 3))
        rotation, place = np.broadcast_to(_STRAIGHT, (n, 3, 3)), np.asarray(base, dtype=float)
        for i, (column, axis) in enumerate(zip(self.columns, self._axes, strict=True)):
            place = place + rotation @ self._offsets[i]
            if not np.array_equal(self._turned[i], _STRAIGHT):
                rotation = rotation @ self._turned[i]
            axes[:, i], origins[:, i] = rotation @ axis, place
            rotation = rotation @ _turn(axis, joints[:, column])
        return ChainPose(axes, origins, place + rotation @ self._end)


def _axis(joint: Any) -> Array:
    """Axis of a revolute joint in its own frame, (3,)."""
    data = joint.createData()
    joint.calc(data, np.zeros(1))
    return np.array(data.S).reshape(6)[3:]


def _turn(axis: Array, angle: Array) -> Array:
    """Rotations about an axis (3,) by angles (N,), (N, 3, 3), by Rodrigues' formula."""
    skew = np.array(pin.skew(axis))
    sine, versed = np.sin(angle)[:, None, None], (1.0 - np.cos(angle))[:, None, None]
    return _STRAIGHT + sine * skew + versed * (skew @ skew)
