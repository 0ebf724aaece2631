"""Errors of the simulated robot; each carries what was wrong as attributes and in its message."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError


class SimBridgeError(DoorImpactError):
    """Base of every error of this package."""


class SimulatorMissingError(SimBridgeError):
    """PyBullet cannot be imported."""

    def __init__(self) -> None:
        super().__init__(
            "the simulation needs PyBullet, which is not installed: run 'pip install pybullet' "
            "(Python 3.11 has a wheel; Python 3.12 builds it and needs g++ and python3-dev)"
        )


class SecondDriverError(SimBridgeError):
    """A driver of a robot is in the graph already.

    Attributes:
        value: the topic that it publishes.
    """

    def __init__(self, topic: str) -> None:
        super().__init__(
            f"someone publishes {topic} already: beside a robot's driver the simulation must not "
            "run (driver:=none leaves it out)"
        )
        self.value = topic


class ModelError(SimBridgeError):
    """The simulator did not take the model as it was given.

    Attributes:
        body: link or joint concerned.
        value: what was found.
        limit: what was asked.
    """

    def __init__(self, body: str, value: object, limit: object, what: str) -> None:
        super().__init__(f"{body}: {what} is {value}, must be {limit}")
        self.body = body
        self.value = value
        self.limit = limit


class TrajectoryRefusedError(SimBridgeError):
    """A trajectory was refused as a whole; the motion under way is unchanged.

    Attributes:
        joint: joint concerned, empty where it is the whole trajectory.
        value: offending value.
        limit: what it had to respect.
    """

    def __init__(self, reason: str, joint: str, value: object, limit: object) -> None:
        where = f"{joint}: " if joint else ""
        super().__init__(f"{where}{reason}: {_short(value)}, limit {_short(limit)}")
        self.reason = reason
        self.joint = joint
        self.value = value
        self.limit = limit


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
