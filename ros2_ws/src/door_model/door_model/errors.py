"""Errors of this package: one base class; every error carries the offending value and the limit."""


from door_impact_common.errors import DoorImpactError


class DoorModelError(DoorImpactError):
    """Base of every error that this package raises on purpose."""


class LinkageError(DoorModelError):
    """The four-bar linkage does not close at an angle.

    Attributes:
        link: Links that are too short or too long, such as "l2 + l3".
        theta: Opening angle at which they are [rad].
    """

    _state = "does not close"

    def __init__(self, link: str, theta: float, reason: str, *, value: float, limit: float) -> None:
        degrees = theta * 57.29577951308232
        super().__init__(
            f"the closer's linkage {self._state} at {degrees:.2f} deg: {reason}",
            value=value,
            limit=limit,
        )
        self.link = link
        self.theta = theta


class DoorParameterError(DoorModelError):
    """A parameter of the door or of a calculation is not a number or out of its range.

    Attributes:
        name: The parameter.
    """

    def __init__(self, name: str, value: object, limit: str) -> None:
        super().__init__(f"{name} must be {limit}, not {value}", value=value, limit=limit)
        self.name = name


class UnreachableAngleError(DoorModelError):
    """The door does not come to rest at the angle asked for, or at any."""


class DeadCentreError(LinkageError, UnreachableAngleError):
    """What is asked for lies beyond a dead centre, from which on the spring opens the door.

    Attributes:
        link: "l3", which lies in line with the fixed part there.
        theta: Opening angle of the dead centre [rad].
    """

    _state = "has its dead centre"

    def __init__(self, theta: float, reason: str, *, value: float) -> None:
        super().__init__(
            "l3",
            theta,
            "link l3 lies in line with the fixed part, eta is 0, and beyond it the spring opens "
            f"the door; {reason}",
            value=value,
            limit=theta,
        )


class ConfigError(DoorModelError):
    """A door's configuration cannot be used.

    Attributes:
        source: The file or name it came from.
    """

    def __init__(
        self, source: str, message: str, *, value: object = None, limit: object = None
    ) -> None:
        super().__init__(f"{source}: {message}", value=value, limit=limit)
        self.source = source


class BadRecordingError(DoorModelError):
    """A recording cannot be read.

    Attributes:
        source: The file.
        line: Its line, counted from 1; None where the whole file is meant.
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
        super().__init__(f"{place}: {message}", value=value, limit=limit)
        self.source = source
        self.line = line


class IdentificationError(DoorModelError):
    """The parameters cannot be identified."""


class NoSwingError(IdentificationError):
    """Nothing in the data looks like a free swing."""


class NoScaleError(IdentificationError):
    """Nothing fixes the scale, which free motion leaves open."""


class NoFitError(IdentificationError):
    """The fit leads to no door, or leaves far too much of the swings."""
