"""Errors of the view."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError


class UrdfError(DoorImpactError):
    """A URDF cannot be read, or has nothing that could be drawn."""

    def __init__(self, problem: str) -> None:
        super().__init__(f"the URDF cannot be drawn: {problem}", quantity="URDF")


class ViewerMissingError(DoorImpactError):
    """The library that serves the page is not installed; `value` is its name."""

    def __init__(self, name: str) -> None:
        super().__init__(
            "the view in the browser needs viser 1.1.1, which is not installed completely "
            f"({name} is missing): run 'pip install viser==1.1.1'", value=name)


class AddressError(DoorImpactError):
    """The page cannot be served at the address `value`."""

    def __init__(self, host: str, problem: str) -> None:
        super().__init__(f"view_host is {host}: {problem}", quantity="view_host", value=host)
