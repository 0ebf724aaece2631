"""Errors of this package: one base class; every error carries the offending value and the limit."""

from __future__ import annotations

import math

from door_impact_common.errors import DoorImpactError


class DoorModelError(DoorImpactError):
    """Base of the errors that this package raises on purpose."""


class LinkageError(DoorModelError):
    """The four-bar linkage does not close at an angle.

    Attributes:
        link: Name of the links that are too short or too long, such as "l2 + l3".
        theta: Opening angle at which the linkage does not close [rad].
    """

    _state = "does not close"

    def __init__(
        self, link: str, theta: float, explanation: str, *, value: float, limit: float
    ) -> None:
        super().__init__(
            f"the closer's linkage {self._state} at {math.degrees(theta):.2f} deg: {explanation}",
            quantity=link,
            value=value,
            limit=limit,
        )
        self.link = link
        self.theta = theta


class DoorParameterError(DoorModelError):
    """A parameter of the door or of a calculation is not a number or out of its range."""

    def __init__(self, name: str, value: object, limit: str) -> None:
        super().__init__(
            f"{name} must be {limit}, not {value}", quantity=name, value=value, limit=limit
        )


class UnreachableAngleError(DoorModelError):
    """The door does not come to rest at the desired angle, or at any angle."""


class DeadCentreError(LinkageError, UnreachableAngleError):
    """The motion passes a dead centre, beyond which the spring opens the door.

    Attributes:
        link: "l3", which lies in line with the fixed part there.
        theta: Opening angle of the dead centre [rad].
    """

    _state = "has its dead centre"

    def __init__(self, theta: float, explanation: str, *, value: float) -> None:
        super().__init__(
            "l3",
            theta,
            "link l3 lies in line with the fixed part, eta is 0, and beyond it the spring opens "
            f"the door; {explanation}",
            value=value,
            limit=theta,
        )


class ConfigError(DoorModelError):
    """The configuration of a door cannot be used.

    Attributes:
        source: File or name from which the configuration comes.
    """

    def __init__(
        self, source: str, message: str, *, value: object = None, limit: object = None
    ) -> None:
        super().__init__(f"{source}: {message}", quantity=source, value=value, limit=limit)
        self.source = source


class BadRecordingError(DoorModelError):
    """A recording cannot be read or used.

    Attributes:
        source: The file.
        line: Line of the file, counted from 1; None if the whole file is meant.
    """

    def __init__(
        self,
        source: str,
        line: int | None,
        message: str,
        *,
        value: object = None,
        limit: object = None,
    ) -> None:
        place = source if line is None else f"{source}:{line}"
        super().__init__(f"{place}: {message}", quantity=place, value=value, limit=limit)
        self.source = source
        self.line = line


class NoSwingError(DoorModelError):
    """The recording contains no free swing."""


class NoScaleError(DoorModelError):
    """Nothing fixes the scale of the parameters, which free motion leaves open."""


class NoFitError(DoorModelError):
    """The fit leads to no door, or its residuals are far too large."""
