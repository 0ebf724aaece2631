"""The errors that all packages share."""

from __future__ import annotations

from typing import Any


class DoorImpactError(Exception):
    """Base of every error that this project raises on purpose.

    A value breaks a limit, or something that is needed is missing. Nodes and commands show the
    message in one line, without a traceback; programs read the attributes.

    Args:
        message: Text for users; if it is empty, the text consists of quantity, value and limit.
        quantity: Value of the attribute, as are the arguments that follow.
        value: Value of the attribute.
        limit: Value of the attribute.
        phase: Value of the attribute.
        reason: Value of the attribute; if it is empty, that of the class stays.

    Attributes:
        quantity: Name of the quantity that is out of bounds, with its unit, such as
            ``"door_distance [m]"``.
        value: Offending value.
        limit: Limit that the value breaks; None if there is no single limit.
        phase: Phase of the motion in which the error occurs; empty outside motions.
        reason: Kind of the error for programs, in one word such as ``"joint_limit"``.
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

    def __reduce__(self) -> Any:
        """Let an error pass between processes, whatever the arguments of its class are."""
        return _same_error, (type(self), self.args, self.__dict__)


def _same_error(
    kind: type[DoorImpactError], args: tuple[Any, ...], attributes: dict[str, Any]
) -> DoorImpactError:
    error = kind.__new__(kind)
    error.args = args
    error.__dict__.update(attributes)
    return error


class InputError(DoorImpactError):
    """A file cannot be read, may not be read, or has unusable content.

    The message contains nothing of the file's content.

    Attributes:
        source: Path of the file, shortened for messages.
        problem: What is wrong, without the path.
    """

    reason = "file"

    def __init__(self, source: str, problem: str) -> None:
        super().__init__(f"{source}: {problem}", quantity="file", value=source)
        self.source = source
        self.problem = problem


class OutputError(DoorImpactError):
    """A file or a folder cannot be written."""


class SettingError(DoorImpactError):
    """A parameter, a setting or a part of a message is missing, out of range or of a wrong type.

    Attributes:
        setting: Name of the setting.
    """

    reason = "setting"

    def __init__(self, setting: str, value: object, limit: object) -> None:
        super().__init__(quantity=setting, value=value, limit=limit)
        self.setting = setting
