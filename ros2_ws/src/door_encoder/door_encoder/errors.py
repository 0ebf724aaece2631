"""Errors of this package: one base class; every error carries the offending value and the limit."""

from door_impact_common.errors import DoorImpactError


class DoorEncoderError(DoorImpactError):
    """Base of every error that this package raises on purpose."""


class EncoderSettingError(DoorEncoderError):
    """A setting of the decoder is out of its range."""


class BadBatchError(DoorEncoderError):
    """A batch of samples cannot be used."""


class BoardError(DoorEncoderError):
    """A counter board cannot be used, or does not answer."""


class PlaybackError(DoorEncoderError):
    """A recording cannot be played as a board would send it."""
