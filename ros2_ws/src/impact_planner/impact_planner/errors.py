"""Errors: one class for each error code of the service PlanDoorImpact, and of the executor."""

from __future__ import annotations


class ImpactError(Exception):
    """Base of this package's errors.

    Attributes:
        quantity: What is out of bounds, with its unit, e.g. ``"door_distance [m]"``.
        value: The offending value.
        limit: The limit that it breaks; None where there is none (an unknown word, no door).
    """

    def __init__(
        self,
        message: str,
        *,
        quantity: str = "",
        value: float | str | None = None,
        limit: float | tuple[float, float] | str | None = None,
    ) -> None:
        super().__init__(message)
        self.quantity = quantity
        self.value = value
        self.limit = limit


class PlannerError(ImpactError):
    """A plan cannot be made.

    Attributes:
        code_name: Name of the service's error code.
    """

    code_name = "INVALID_REQUEST"


class InvalidRequest(PlannerError):
    """A request that holds no number, a number outside its range or an unknown word."""

    code_name = "INVALID_REQUEST"


class ExperienceUnreadable(PlannerError):
    """The file of what hits have taught is none."""

    code_name = "INVALID_REQUEST"


class NoDoor(PlannerError):
    """Nothing is known of the door: neither identified nor configured."""

    code_name = "NO_DOOR"


class AngleUnreachable(PlannerError):
    """The linkage does not assemble at the angle, or the arm does not reach the leaf there."""

    code_name = "ANGLE_UNREACHABLE"


class SpeedUnreachable(PlannerError):
    """The run-up to the speed of B would take the ZMP out of the support polygon."""

    code_name = "SPEED_UNREACHABLE"


class PostureUnreachable(PlannerError):
    """The feet, the waist height or the contact are out of reach of the legs."""

    code_name = "POSTURE_UNREACHABLE"


class JointLimit(PlannerError):
    """A joint would exceed its range, speed or torque.

    Attributes:
        joint: Name of the joint.
        phase: Phase of the plan in which it happens.
    """

    code_name = "JOINT_LIMIT"

    def __init__(
        self,
        message: str,
        *,
        joint: str = "",
        phase: str = "",
        quantity: str = "",
        value: float | str | None = None,
        limit: float | tuple[float, float] | str | None = None,
    ) -> None:
        super().__init__(message, quantity=quantity, value=value, limit=limit)
        self.joint = joint
        self.phase = phase


class GoalRefused(ImpactError):
    """A goal cannot be executed.

    Attributes:
        code_name: Name of the action's error code.
    """

    def __init__(
        self,
        code_name: str,
        message: str,
        *,
        quantity: str = "",
        value: float | str | None = None,
        limit: float | tuple[float, float] | str | None = None,
    ) -> None:
        super().__init__(message, quantity=quantity, value=value, limit=limit)
        self.code_name = code_name
