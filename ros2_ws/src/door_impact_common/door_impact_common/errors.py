"""The base of every error that this project raises on purpose."""

from __future__ import annotations


class DoorImpactError(Exception):
    """A value breaks a limit, or something that is needed is missing.

    Each package derives its own base from this class.

    Attributes:
        quantity: What is out of bounds, with its unit, such as ``"door_distance [m]"``.
        value: The offending value.
        limit: The limit that it breaks; None where there is no single one.
        phase: Phase of the motion in which it happens; empty outside motions.
        reason: One word for the kind of error, such as ``"joint_limit"``, for programs to read.
    """

    reason = ""

    def __init__(
        self,
        message: str = "",
        *,
        quantity: str = "",
        value: object = None,
        limit: object = None,
        phase: str = "",
        reason: str = "",
    ) -> None:
        super().__init__(message or f"{quantity} is {value}, must be {limit}")
        self.quantity = quantity
        self.value = value
        self.limit = limit
        self.phase = phase
        if reason:
            self.reason = reason


class OutputError(DoorImpactError):
    """A file or a folder cannot be written."""


class SettingError(DoorImpactError):
    """A parameter, a setting or a part of a message is not what it must be.

    Attributes:
        setting: Its name.
    """

    reason = "setting"

    def __init__(self, setting: str, value: object, limit: object) -> None:
        super().__init__(quantity=setting, value=value, limit=limit)
        self.setting = setting
