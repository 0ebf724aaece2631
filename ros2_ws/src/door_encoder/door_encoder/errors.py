"""Errors of this package: one base class; every error carries the offending value and the limit."""

from door_impact_common.errors import DoorImpactError


class DoorEncoderError(DoorImpactError):
    """Base of the errors that this package raises on purpose."""


class BadBatchError(DoorEncoderError):
    """A received batch of samples cannot be used."""


class BoardError(DoorEncoderError):
    """A counter board cannot be found or opened, or its reading is out of range."""


class PlaybackError(DoorEncoderError):
    """A recording cannot be cut into the batches that a counter board would have sent."""
