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


class ViewerMissingError(ViewError):
    """The library that serves the page is not installed; `value` is its name."""

    def __init__(self, name: str) -> None:
        super().__init__(
            "the view in the browser needs viser 1.1.1, which is not installed completely "
            f"({name} is missing): run 'pip install viser==1.1.1'", value=name)


class AddressError(ViewError):
    """The page cannot be served at the address that was asked for.

    Attributes:
        value: The address.
    """

    def __init__(self, setting: str, value: object, problem: str) -> None:
        super().__init__(f"{setting} is {value}: {problem}", quantity=setting, value=value)
