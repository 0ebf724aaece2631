"""Errors of the recorder."""

from door_impact_common.errors import DoorImpactError


class BringupError(DoorImpactError):
    """Base of every error of this package."""


class McapWriteError(BringupError):
    """An MCAP file cannot be written; the message names the file and the reason.

    Attributes:
        path: Path of the file.
    """

    def __init__(self, path: object, what: str) -> None:
        super().__init__(f"{path}: {what}", value=str(path))
        self.path = path


class DefinitionError(BringupError):
    """The definition of a message is missing or cannot be read.

    Attributes:
        name: Name of the message, ``package/msg/Name``, or of the topic.
    """

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"no definition of {name}: {why}", value=name)
        self.name = name
