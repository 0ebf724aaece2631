"""Errors of this package."""

from __future__ import annotations

from typing import Any

from door_impact_common.errors import DoorImpactError


class HumanoidMotionError(DoorImpactError):
    """Base of this package's errors."""


class PostureUnreachable(HumanoidMotionError):
    """A posture would put a foot, the waist or a contact out of reach, or two bodies too close."""

    reason = "posture_unreachable"


class JointLimit(HumanoidMotionError):
    """A joint would exceed its range, speed or torque.

    Attributes:
        joint: Name of the joint.
    """

    reason = "joint_limit"

    def __init__(self, message: str, *, joint: str = "", **attributes: Any) -> None:
        super().__init__(message, **attributes)
        self.joint = joint
