"""Errors of hrp2_description."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError


class DescriptionError(DoorImpactError, ValueError):
    """Base of this package's errors.

    Attributes:
        value: Value that was found.
        limit: Value or range that was expected, as a number or in words.
    """

    def __init__(self, message: str, *, value: object = None, limit: object = None) -> None:
        super().__init__(
            f"{message} (found {value!r}, expected {limit!r})", value=value, limit=limit)


class RobotConfigError(DescriptionError):
    """The robot's configuration file is incomplete or contradicts the URDF."""


class DegeneratePolygonError(DescriptionError):
    """The points of a polygon span no area or are not finite."""
