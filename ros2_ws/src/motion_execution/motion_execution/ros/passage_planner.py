"""Plans hits and passages for the node door_passer."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from door_impact_common.node import GuardedNode
from door_impact_msgs.msg import CloserParameters, ImpactPlan
from door_model.door.config import load_door
from door_model.door.door import Door
from door_model.errors import DoorModelError
from door_model.ros.messages import door_of
from hrp2_description.robot import needed
from humanoid_motion.mirror import Straight
from humanoid_motion.robot_model import RobotModel
from rclpy.qos import DurabilityPolicy, QoSProfile
from walking.errors import PLANNING_ERRORS, HitNotPlanned, InvalidGoal, PassageInfeasible
from walking.footsteps.footstep import Stance
from walking.passing.approach import AS_SURVEYED, Site
from walking.passing.doorway import Doorway
from walking.passing.held import HITS, Hold
from walking.passing.opening import HIT, Opening, choose_opening
from walking.passing.passage import PassagePlan, plan_passage
from walking.passing.passage_task import PassageTask
from walking.passing.route import OPENING
from walking.passing.settings import PassageSettings

from motion_execution.ros.background import Background
from motion_execution.ros.clients import HitPlanner
from motion_execution.ros.passer_messages import hold_of, plan_message


def never() -> bool:
    """Say of something that is always wanted that it is not stopped."""
    return False


class PassagePlanner:
    """Knows the door, and plans what opens it and what passes it.

    Args:
        node: Node that hears of the door.
        robot: The robot.
        door: Name or YAML file of the door; empty: its frame is not known.
        settings: Settings of the passage.
        hits: Plans the hits.
        seen: How the node sees robot and door.

    Attributes:
        last_hit: The last hit that was planned by anyone; None before.
    """

    def __init__(
        self, node: GuardedNode, robot: RobotModel, door: str, settings: PassageSettings,
        hits: HitPlanner, seen: Straight,
    ) -> None:
        self._node, self._names, self._settings, self._hits, self._seen = (
            node, robot.joint_names, settings, hits, seen)
        self._width = needed(robot.config.footsteps, "footsteps").width
        self._door = load_door(door) if door else None
        self._background = Background(node, robot.config)
        self._identified: tuple[str, Door] | None = None  # name and dynamics
        self._numbers = itertools.count(1)  # of the plans
        self.last_hit: ImpactPlan | None = None
        self._site: tuple[str, Site] = "", AS_SURVEYED  # of the plan of a hit with this plan_id
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_subscription(CloserParameters, "/closer_parameters", self._on_closer, latched)
        node.create_subscription(ImpactPlan, "/door_impact_plan", self._on_hit, latched)

    def close(self) -> None:
        """End the planning thread."""
        self._background.close()

    async def opening(
        self, wanted: Any, hinge: Array, site: Site, stopped: Callable[[], bool]
    ) -> tuple[str, Opening]:
        """Choose between hit and push; return the door's name beside it.

        Args:
            wanted: A goal or a request.
            hinge: x and y of the hinge in the axes of the site, (2,) [m].
            site: Where the robot stands.
            stopped: Whether they are not wanted any more.

        Raises:
            DoorImpactError: A push is wanted, and cannot be made.
        """
        known, (name, door) = self._door, self._identified or ("", None)
        if known is None or known.frame is None:
            return "", Opening(HIT, "hit: nothing is known of the door's frame")
        return known.name, await self._background.run(
            choose_opening, door if door and name == known.name else known.door(),
            Doorway(hinge, known.leaf, known.frame), Stance.around(site.soles, self._width),
            wanted.opening, self._with_angles(wanted.leaf_angle), stopped=stopped)

    async def hit_and_passage(
        self, wanted: Any, site: Site, stopped: Callable[[], bool] = never
    ) -> tuple[ImpactPlan, Hold, PassagePlan]:
        """Plan a hit, and the passage from its end.

        Args:
            wanted: A goal or a request.
            site: Where the hit begins.
            stopped: Whether they are not wanted any more.

        Raises:
            DoorImpactError: There is no hit, or none from whose end there is a passage; the error
                is that of the first hit of `HITS`.
        """
        refused: DoorImpactError | None = None
        asked = [(wanted.hit_angle, ending) for ending in dict.fromkeys(e for _, e in HITS)]
        for angle, ending in HITS if wanted.hit_angle < 0.0 else asked:
            try:
                hit = self._seen.message(
                    await self._hits.plan(angle, ending, wanted.run_up, site.seen, stopped))
                self._site = hit.plan_id, site
                hold = self.hold(hit)
                return hit, hold, await self.passage(
                    hold.task(), wanted.leaf_angle, stopped=stopped)
            except (PassageInfeasible, HitNotPlanned, InvalidGoal) as error:
                refused = refused or error
                if isinstance(error, InvalidGoal) or error.quantity == OPENING:
                    break  # no other hit is a remedy
        assert refused is not None
        raise refused

    async def passage(
        self, task: PassageTask, angle: float, before: PassagePlan | None = None,
        stopped: Callable[[], bool] = never,
    ) -> PassagePlan:
        """Plan a passage.

        Args:
            angle: Wanted angle of the leaf [rad]; negative: the planner chooses.
            before: A passage of the same door, whose way is tried first.
            stopped: Whether the plan is not wanted any more.

        Raises:
            PassageInfeasible: There is no passage.
            Stopped: The plan is not wanted any more.
        """
        return await self._background.run(
            _passage, task, self._with_angles(angle), before, stopped=stopped)

    def _with_angles(self, angle: float) -> PassageSettings:
        angles = self._settings.leaf_angles if angle < 0.0 else (angle,)
        return replace(self._settings, leaf_angles=angles)

    def hold(self, hit: ImpactPlan) -> Hold:
        """Return how a hit is planned to end; errors are those of `hold_of`."""
        name, door = self._identified or ("", None)
        plan_id, site = self._site
        return hold_of(hit, self._names, self._door, door if name == hit.door else None,
                       site if plan_id == hit.plan_id else AS_SURVEYED)

    def message(self, plan: PassagePlan, hold: Hold, door: str, opening: Opening) -> Any:
        """Convert a passage through a door that is opened so before, or is held, to its message."""
        message = plan_message(plan, hold, f"passage-{next(self._numbers)}", door,
                               self._node.get_clock().now().to_msg())
        message.opening, message.opening_reason = opening.way, self._seen.text(opening.reason)
        return self._seen.message(message)

    def _on_closer(self, message: CloserParameters) -> None:
        try:
            self._identified = message.door, door_of(message)
        except DoorModelError as error:
            self._node.get_logger().error(f"/closer_parameters describes no door: {error}")

    def _on_hit(self, message: ImpactPlan) -> None:
        self.last_hit = self._seen.message(message)


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
