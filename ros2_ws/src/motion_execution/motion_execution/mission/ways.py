"""Ways through a door: where the robot opens it, how, and the passage from there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.errors import DoorImpactError
from hrp2_description.robot import needed
from humanoid_motion.robot_model import RobotModel
from walking.errors import PLANNING_ERRORS, HitNotPlanned, InvalidGoal, PassageInfeasible
from walking.footsteps.footstep import Pose, Stance
from walking.passing.approach import AS_SURVEYED, Site
from walking.passing.doorway import Doorway
from walking.passing.held import HITS, Hold
from walking.passing.opening import HIT, Opening, choose_opening
from walking.passing.passage import PassagePlan, plan_passage
from walking.passing.passage_task import PassageTask
from walking.passing.route import OPENING
from walking.passing.settings import PassageSettings

from motion_execution.mission.hit_plan import HitPlan
from motion_execution.mission.link import HitRequest, Link
from motion_execution.mission.order import Order, result_of

HELD = Opening("", "")
"""The robot holds the leaf open already."""


@dataclass(frozen=True)
class Wanted:
    """What is asked of a passage through the door; fields are named as in WalkThroughDoor.

    Attributes:
        hit_angle: Opening angle to which a hit opens the leaf [rad]; negative: what is needed.
        leaf_angle: Angle up to which the hand opens it [rad]; negative: the planner chooses.
        run_up: Profile of the run-up; empty: as configured.
        opening: hit, or push from closed; empty: a light door is pushed.
        walk_up: Whether the robot walks to where the door is opened.
        probe: auto, on or off: whether the leaf is touched slowly before a hit.
        speed_scale: Factor on the speed of a hit's phases before the run-up.
        dry_run: Whether nothing moves.
        hits: Opening angles [rad] and endings of hits, tried until a passage can be planned.
    """

    hit_angle: float = -1.0
    leaf_angle: float = -1.0
    run_up: str = ""
    opening: str = ""
    walk_up: bool = True
    probe: str = "auto"
    speed_scale: float = 1.0
    dry_run: bool = False
    hits: tuple[tuple[float, str], ...] = HITS

    def ladder(self) -> Sequence[tuple[float, str]]:
        """Return angles [rad] and endings of hits in the order in which they are tried."""
        if self.hit_angle < 0.0:
            return self.hits
        return [(self.hit_angle, ending) for ending in dict.fromkeys(e for _, e in self.hits)]


@dataclass(frozen=True)
class Way:
    """A way through the door.

    Attributes:
        door: Name of the door.
        hold: How the hand comes to the leaf, as it is planned.
        passage: The passage from there.
        opening: How the closed leaf is opened, and why.
        site: Where it is opened.
        hit: Plan of the hit; None if there is none.
    """

    door: str
    hold: Hold
    passage: PassagePlan
    opening: Opening = HELD
    site: Site = AS_SURVEYED
    hit: HitPlan | None = None

    @property
    def ahead(self) -> float:
        """Distance of the place of the hit ahead of the soles [m]; 0 of a push."""
        return 0.0 if self.hit is None else float(self.hit.contact_point[0])


class Ways:
    """Plans ways through the door, outside the thread of the messages.

    Args:
        robot: The robot.
        link: Plans hits, and computes.
        settings: Settings of the passage.
        survey: The door as it is to be seen from where a hit begins.

    """

    def __init__(
        self, robot: RobotModel, link: Link, settings: PassageSettings, survey: Pose
    ) -> None:
        self._link, self._settings, self._hinge = link, settings, np.array(survey[:2])
        self._width = needed(robot.config.footsteps, "footsteps").width
        self._site: tuple[str, Site] = "", AS_SURVEYED  # of the plan of a hit with this plan_id

    async def plan(self, wanted: Wanted, site: Site, order: Order) -> Way:
        """Plan the way through the closed door.

        Args:
            site: Where the robot stands, in half-sitting.

        Raises:
            DoorImpactError: There is none.
            Stopped: It is not wanted any more.
        """
        opening = await self._opening(wanted, site, order)
        if opening.push is not None:
            assert self._link.door is not None, "a push is planned for a door"
            return Way(self._link.door.name, replace(opening.push.hold, axes=site.axes),
                       opening.push.passage, opening, site)
        hit, hold, passage = await self._hit_and_passage(wanted, site, order)
        return Way(hit.door, hold, passage, opening, site, hit)

    async def passage(
        self, task: PassageTask, wanted: Wanted, order: Order, before: PassagePlan | None = None,
    ) -> PassagePlan:
        """Plan a passage.

        Args:
            before: A passage of the same door, whose way is tried first.

        Raises:
            PassageInfeasible: There is no passage.
            Stopped: It is not wanted any more.
        """
        return await result_of(
            self._link.compute(_passage, task, self._with_angles(wanted), before), order)

    def hold(self, hit: HitPlan) -> Hold:
        """Return how a hit is planned to end; errors are those of `HitPlan.hold`."""
        plan_id, site = self._site
        return hit.hold(self._link.door, site if plan_id == hit.plan_id else AS_SURVEYED)

    async def _opening(self, wanted: Wanted, site: Site, order: Order) -> Opening:
        """Choose between hit and push; a push that is wanted and cannot be made is an error."""
        known = self._link.door
        if known is None or known.frame is None:
            return Opening(HIT, "hit: nothing is known of the door's frame")
        return await result_of(self._link.compute(
            choose_opening, known.door, Doorway(self._hinge, *known.frame),
            Stance.around(site.soles, self._width), wanted.opening, self._with_angles(wanted)),
            order)

    async def _hit_and_passage(
        self, wanted: Wanted, site: Site, order: Order
    ) -> tuple[HitPlan, Hold, PassagePlan]:
        """Plan the first hit from whose end there is a passage; errors are those of the first."""
        refused: DoorImpactError | None = None
        for angle, ending in wanted.ladder():
            try:
                hit = await result_of(self._link.plan_hit(
                    HitRequest(angle, ending, wanted.run_up, *site.seen)), order)
                self._site = hit.plan_id, site
                hold = self.hold(hit)
                return hit, hold, await self.passage(hold.task(), wanted, order)
            except (PassageInfeasible, HitNotPlanned, InvalidGoal) as error:
                refused = refused or error
                if isinstance(error, InvalidGoal) or error.quantity == OPENING:
                    break  # no other hit is a remedy
        assert refused is not None, "no angle is tried"
        raise refused

    def _with_angles(self, wanted: Wanted) -> PassageSettings:
        given = wanted.leaf_angle
        angles = self._settings.leaf_angles if given < 0.0 else (given,)
        return replace(self._settings, leaf_angles=angles)


def _passage(
    robot: RobotModel, task: PassageTask, settings: PassageSettings, before: PassagePlan | None
) -> PassagePlan:
    """Plan a passage.

    Raises:
        PassageInfeasible: There is none.
    """
    try:
        return plan_passage(robot, task, settings, before)
    except PLANNING_ERRORS as error:
        raise PassageInfeasible(f"no passage can be planned: {error}", quantity=error.quantity,
                                value=error.value, limit=error.limit) from error
