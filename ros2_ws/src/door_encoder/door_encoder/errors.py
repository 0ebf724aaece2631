"""Errors of this package: one base class; every error carries the offending value and the limit."""


class DoorEncoderError(Exception):
    """Base of every error that this package raises on purpose.

    Attributes:
        value: What was wrong.
        limit: What it should have kept to, None where no single limit exists.
    """

    def __init__(self, message: str, *, value: object = None, limit: object = None) -> None:
        super().__init__(message)
        self.value = value
        self.limit = limit


class EncoderSettingError(DoorEncoderError):
    """A setting of the decoder is out of its range."""


class BadBatchError(DoorEncoderError):
    """A batch of samples cannot be used."""


class BoardError(DoorEncoderError):
    """A counter board cannot be used, or does not answer."""


class PlaybackError(DoorEncoderError):
    """A recording cannot be played as a board would send it."""
