"""Errors of the recorder and of the scene."""

from door_impact_common.errors import DoorImpactError


class BringupError(DoorImpactError):
    """Base of every error of this package."""


class RecordingError(BringupError):
    """A recording cannot be written; the message names the file.

    Attributes:
        path: The file.
    """

    def __init__(self, path: object, what: str) -> None:
        super().__init__(f"{path}: {what}", value=str(path))
        self.path = path
