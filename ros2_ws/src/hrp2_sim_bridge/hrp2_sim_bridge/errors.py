"""Errors of the simulated robot."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError


class SimBridgeError(DoorImpactError):
    """Base of every error of this package."""


class SimulatorMissingError(SimBridgeError):
    """A physics engine, whose name is the value, cannot be imported."""

    def __init__(
        self,
        engine: str = "PyBullet",
        remedy: str = "'pip install pybullet' (Python 3.11 has a wheel; Python 3.12 builds it and "
        "needs g++ and python3-dev)",
    ) -> None:
        super().__init__(
            f"the simulation needs {engine}, which is not installed: run {remedy}", value=engine)


class DivergedError(SimBridgeError):
    """The simulation is no longer a finite number; the value is the time since its start [s]."""

    def __init__(self, engine: str, time: float) -> None:
        super().__init__(
            f"the simulation in {engine} diverged {time:.4f} s after its start: reset it, and take "
            "shorter physics steps or smaller torques", value=time)


class SecondDriverError(SimBridgeError):
    """Another driver of a robot publishes a topic, the value, already."""

    def __init__(self, topic: str) -> None:
        super().__init__(
            f"another node publishes {topic} already: the simulation must not run together with "
            "the driver of a robot (driver:=none leaves the simulation out)", value=topic)


class ModelError(SimBridgeError):
    """The simulator changed the model of the robot: value there, and limit in the model.

    Attributes:
        body: Name of the link, joint or robot concerned.
    """

    def __init__(self, body: str, value: object, limit: object, what: str) -> None:
        super().__init__(
            f"{body}: {what} is {value}, must be {limit}", quantity=what, value=value, limit=limit)
        self.body = body


class TrajectoryRefusedError(SimBridgeError):
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
