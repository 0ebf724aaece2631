"""Errors of the view."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError


class ViewError(DoorImpactError):
    """Base of the errors that this package raises on purpose."""


class UrdfError(ViewError):
    """A URDF cannot be read, or what it describes is no tree of links.

    Attributes:
        value: The offending element or text, shortened.
    """

    def __init__(self, problem: str, value: object = None) -> None:
        super().__init__(f"the URDF cannot be drawn: {problem}", quantity="URDF", value=value)
