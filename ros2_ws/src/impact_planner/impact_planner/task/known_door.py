"""The door as the planner knows it: identified or configured parameters, and experience."""

from __future__ import annotations

import math
from dataclasses import dataclass

from door_impact_common.arrays import Array
from door_model.door.config import DoorConfig
from door_model.door.door import Door
from door_model.door.geometry import Frame, Hinge, Leaf

from impact_planner.task.experience import Experience


@dataclass(frozen=True)
class KnownDoor:
    """A door and the uncertainty of its parameters.

    Attributes:
        name: Name of the door.
        door: Parameters of eq. (1).
        width: Width of the leaf from the hinge to the free edge [m].
        parameters: Names of the identified parameters, (P,), such as "k_c".
        covariance: Covariance of the identified parameters, (P, P) in SI units. None means that
            all parameters are taken as exact.
        warnings: Warnings of the identification.
        experience: Knowledge from earlier hits on this door; None before the first hit.
        top: Height of the leaf's upper edge above the floor [m]; infinite where it is not known.
        frame: The leaf and its frame; None where the frame is not known.
        hinge: Side of the hinge; every plan is for a hinge at the right, if need be in a mirror.
    """

    name: str
    door: Door
    width: float
    parameters: tuple[str, ...] = ()
    covariance: Array | None = None
    warnings: tuple[str, ...] = ()
    experience: Experience | None = None
    top: float = math.inf
    frame: tuple[Leaf, Frame] | None = None
    hinge: Hinge = "right"

    @classmethod
    def configured(cls, config: DoorConfig) -> KnownDoor:
        """Make a door whose configured parameters are taken as exact."""
        frame = None if config.frame is None else (config.leaf, config.frame)
        return cls(config.name, config.door(), config.leaf.width, warnings=config.doubts(),
                   top=config.leaf.top, frame=frame, hinge=config.hinge)
