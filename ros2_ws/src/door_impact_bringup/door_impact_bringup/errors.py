"""Errors of the demonstration and of the nodes around it."""


class BringupError(Exception):
    """Base of every error of this package."""


class DemoError(BringupError):
    """The demonstration cannot go on; the message says why and what to do."""


class NodeEndedError(DemoError):
    """One of the nodes has ended by itself."""


class SettingError(BringupError):
    """A parameter of a node is not what it must be.

    Attributes:
        setting: Its name.
        value: What was given.
        limit: What it must be.
    """

    def __init__(self, setting: str, value: object, limit: str) -> None:
        super().__init__(f"{setting} is {value!r}, must be {limit}")
        self.setting = setting
        self.value = value
        self.limit = limit


class RecordingError(BringupError):
    """A recording cannot be written; the message names the file.

    Attributes:
        path: The file.
    """

    def __init__(self, path: object, what: str) -> None:
        super().__init__(f"{path}: {what}")
        self.path = path
