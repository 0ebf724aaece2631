"""What is known of the door when a hit is planned."""

from __future__ import annotations

from dataclasses import dataclass

from door_impact_common.arrays import Array
from door_model.door.config import DoorConfig
from door_model.door.door import Door

from impact_planner.task.experience import Experience


@dataclass(frozen=True)
class KnownDoor:
    """What is known of the door.

    Attributes:
        name: Name.
        door: Parameters of eq. (1).
        width: Of the leaf, hinge to free edge [m].
        parameters: Names of what was identified (P,), such as "k_c".
        covariance: Of these, (P, P) in SI units; None: taken as exact.
        warnings: Of the identification.
        experience: What hits on it have taught; None: nothing yet.
    """

    name: str
    door: Door
    width: float
    parameters: tuple[str, ...] = ()
    covariance: Array | None = None
    warnings: tuple[str, ...] = ()
    experience: Experience | None = None

    @classmethod
    def configured(cls, config: DoorConfig) -> KnownDoor:
        """A door that is exactly as its configuration says."""
        return cls(config.name, config.door(), config.leaf.width)
