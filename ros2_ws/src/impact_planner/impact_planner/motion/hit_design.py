"""All decisions about the hit that precede the trajectories, sections II.C.1 to II.C.4."""

from __future__ import annotations

from dataclasses import dataclass

from impact_planner.hit.door_prediction import DoorPrediction
from impact_planner.hit.placement import Placement
from impact_planner.hit.stance import HitStance, LeafContact
from impact_planner.hit.transfer import MomentumTransfer
from impact_planner.motion.run_up import RunUpPlan


@dataclass(frozen=True)
class HitDesign:
    """The design of a hit: where the robot stands, how fast it hits, and how it gets there.

    Attributes:
        placement: Place of the door, section II.C.1.
        stance: Feet and posture at the hit, sections II.C.1 and II.C.4.
        contact: Place where the elbow meets the leaf.
        prediction: Motion of the door after the hit, section II.C.2.
        transfer: Effective mass, speeds of B and loads of the hit, section II.C.3.
        run_up: Motion of the CoM that brings B to its speed, section II.C.4.
    """

    placement: Placement
    stance: HitStance
    contact: LeafContact
    prediction: DoorPrediction
    transfer: MomentumTransfer
    run_up: RunUpPlan
