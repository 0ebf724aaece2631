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
