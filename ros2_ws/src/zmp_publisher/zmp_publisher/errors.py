"""Errors of this package."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError


class ZmpPublisherError(DoorImpactError):
    """A parameter or a message cannot be used."""
