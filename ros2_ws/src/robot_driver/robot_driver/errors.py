"""Errors of a robot's driver."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError


class TrajectoryRefusedError(DoorImpactError):
    """A trajectory was refused as a whole; the present motion is unchanged.

    Attributes:
        reason: What is wrong, in words, with the unit of the value.
        joint: Name of the joint concerned; empty if the error concerns the whole trajectory.
    """

    def __init__(self, reason: str, joint: str, value: object, limit: object) -> None:
        where = f"{joint}: " if joint else ""
        found = "" if joint and value == joint else f": {_short(value)}"
        super().__init__(
            f"{where}{reason}{found}, allowed: {_short(limit)}", value=value, limit=limit,
            reason=reason)
        self.joint = joint


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
