"""What a demonstration received from the nodes: its results are made of this and of the log."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from door_impact_common.arrays import Array


@dataclass(frozen=True)
class Received:
    """Messages, answers and times that the demonstration received, as any user of the nodes can.

    Attributes:
        door: Name or YAML file of the simulated door.
        target_deg: Desired opening angle [deg].
        parameters: Message CloserParameters with the identified door.
        plan: Message ImpactPlan with the plan that was executed.
        outcome: Result of the action ExecuteDoorImpact.
        planning_ms: Wall time from the request to the answer of the planning service [ms].
        real_time_factor: Simulated time over wall time.
        wall_s: Wall time of the demonstration [s].
        door_angle: Stamp and angle of every message on /door_angle (n, 2) [s, rad].
        zmp: Stamp, x and y of every message on /zmp, in odom (m, 3) [s, m, m].
        samples: Messages EncoderSamples of the pushes by hand.
        phases: Start [s] and name of each phase, by the action's feedback.
        end: Time at which the motion had ended [s].
    """

    door: str
    target_deg: float
    parameters: Any
    plan: Any
    outcome: Any
    planning_ms: float
    real_time_factor: float
    wall_s: float
    door_angle: Array
    zmp: Array
    samples: Sequence[Any]
    phases: list[tuple[float, str]]
    end: float
