"""All that is decided about the hit before trajectories are made."""

from __future__ import annotations

from dataclasses import dataclass

from impact_planner.hit import momentum
from impact_planner.hit.door_prediction import DoorPrediction
from impact_planner.hit.floor_load import FloorLoad
from impact_planner.hit.placement import Placement
from impact_planner.hit.stance import Contact, Stance
from impact_planner.motion.run_up import RunUpPlan


@dataclass(frozen=True)
class HitDesign:
    """The hit.

    Attributes:
        placement: Where the door is.
        stance: Feet and posture.
        contact: Where the elbow meets the leaf.
        door: What the door does.
        mass: Effective mass planned with [kg].
        model_mass: The same by the model alone [kg].
        speeds: Of B, along the leaf's normal.
        floor: What the feet must bear.
        brace: Impulse of the torque at each braced joint [N m s].
        run_up: The run-up.
    """

    placement: Placement
    stance: Stance
    contact: Contact
    door: DoorPrediction
    mass: float
    model_mass: float
    speeds: momentum.ImpactSpeeds
    floor: FloorLoad
    brace: dict[str, float]
    run_up: RunUpPlan
