"""The part of a hit's plan that its execution, and the passage after it, need."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import Knots
from humanoid_motion.leaf import LeafFrame
from impact_planner.task.known_door import KnownDoor
from walking.errors import HitNotPlanned, NoDoor
from walking.footsteps.footstep import Stance
from walking.passing.approach import Site
from walking.passing.doorway import Doorway
from walking.passing.held import Hold

from motion_execution.hit.types import ExecutablePlan


@dataclass(frozen=True)
class HitPlan:
    """A plan of a hit, as seen from the middle between the soles at its begin.

    Attributes:
        plan_id: Name of the plan.
        door: Name of the door.
        executable: Its phases, and the numbers that its execution needs.
        left_foot: Place of the left sole at the hit, (2,) [m].
        right_foot: Place of the right sole at the hit, (2,) [m].
        contact_point: Place of B at the hit, (2,) [m].
        l_b: Distance of B from the hinge [m].
        initial_angle: Angle of the door at which it is hit [rad].
        missed_margin: Smallest ZMP margin if the robot misses the door [m].
        margins: Smallest planned ZMP margin by phase [m].
    """

    plan_id: str
    door: str
    executable: ExecutablePlan
    left_foot: Array
    right_foot: Array
    contact_point: Array
    l_b: float
    initial_angle: float
    missed_margin: float
    margins: Mapping[str, float]

    @classmethod
    def of(
        cls, plan: Any, phases: dict[str, Knots], margins: Mapping[str, float],
        *places: Array,
    ) -> HitPlan:
        """Make it from an `ImpactPlan` or its message, which share their names.

        Args:
            plan: The plan or its message.
            phases: Knots of its phases and branches by name.
            margins: Smallest planned ZMP margin by phase [m].
            places: Places of left sole, right sole and B, of which x and y count [m].

        Raises:
            InvalidRequest: A phase is missing, or a number is out of its range.
        """
        left, right, b = (np.asarray(place[:2], dtype=float) for place in places)
        return cls(plan.plan_id, plan.door, ExecutablePlan.of(plan, phases), left, right, b,
                   plan.l_b, plan.initial_angle, plan.missed_margin, margins)

    def hold(self, known: KnownDoor | None, site: Site) -> Hold:
        """Return how the hit is planned to end.

        Args:
            known: What is known of the door.
            site: Where the hit begins.

        Raises:
            HitNotPlanned: The plan does not end with a held leaf, or a number of it makes no sense.
            NoDoor: Nothing is known of the frame of the plan's door.
        """
        if known is None or known.frame is None or known.name != self.door:
            raise NoDoor(
                f"nothing is known of the frame of the door {self.door!r}: the parameter door " + (
                    "is empty" if known is None else
                    f"names the door {known.name!r}" if known.frame is not None else
                    "names a file without a frame"), quantity="door", value=self.door)
        left, right, point = (site.soles.moved(*map(float, each)) for each in (
            self.left_foot, self.right_foot, self.contact_point))
        along = LeafFrame(np.zeros(2), self.initial_angle).along
        hinge = np.array(point[:2]) - self.l_b * along[:2]
        held, last = self.executable.held_angle, self.executable.phases.get("hold")
        if last is None or not np.isfinite([*hinge, *left, *right, held]).all():
            raise HitNotPlanned(
                f"the hit of plan {self.plan_id!r} does not end with a held leaf, or a number of "
                "it is not finite", quantity="plan_id", value=self.plan_id)
        return Hold(known.door, Doorway(hinge, *known.frame), held, Stance(left, right),
                    last.position[-1], site.axes)
