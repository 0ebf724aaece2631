"""Opens the door for the node door_passer: by a hit, or by the hand on the closed leaf."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan
from humanoid_motion.robot_model import RobotModel
from walking.footsteps.footstep import Pose
from walking.passing.approach import AS_SURVEYED, Site
from walking.passing.held import Hold
from walking.passing.opening import Opening, Push
from walking.passing.passage import PassagePlan

from motion_execution.ros.clients import MotionClient
from motion_execution.ros.passage_planner import PassagePlanner, never
from motion_execution.ros.passer_messages import Result, end_code
from motion_execution.walk.reaching import Reaching

HELD = Opening("", "")
"""The robot holds the leaf open already."""


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
    hit: ImpactPlan | None = None

    @property
    def ahead(self) -> float:
        """Distance of the place of the hit ahead of the soles [m]; 0 of a push."""
        return 0.0 if self.hit is None else float(self.hit.contact_point.x)


class Openings:
    """Plans and makes what opens the door.

    Args:
        robot: The robot.
        planner: Plans hits and passages.
        hits: Executes hits.
        survey: The door as it is seen from where a hit begins.
        move: Makes a motion, until it has ended or a function says that it is not wanted.
        on_hit: Function that gets the feedback of a hit.
    """

    def __init__(
        self, robot: RobotModel, planner: PassagePlanner, hits: MotionClient, survey: Pose,
        move: Callable[[Way, Reaching, Callable[[], bool]], Awaitable[None]],
        on_hit: Callable[[Any], None],
    ) -> None:
        self._robot, self._planner, self._hits = robot, planner, hits
        self._hinge = np.array(survey[:2])
        self._move, self._on_hit = move, on_hit

    async def plan(self, wanted: Any, site: Site, stopped: Callable[[], bool] = never) -> Way:
        """Plan the way through the closed door.

        Args:
            wanted: A goal or a request.
            site: Where the robot stands, in half-sitting.
            stopped: Whether the way is not wanted any more.

        Raises:
            DoorImpactError: There is none.
        """
        door, opening = await self._planner.opening(wanted, self._hinge, site, stopped)
        push = opening.push
        if push is not None:
            return Way(door, replace(push.hold, axes=site.axes), push.passage, opening, site)
        hit, hold, passage = await self._planner.hit_and_passage(wanted, site, stopped)
        return Way(hit.door, hold, passage, opening, site, hit)

    async def make(
        self, way: Way, goal: Any, goal_id: Any, result: Any, stopped: Callable[[], bool]
    ) -> bool:
        """Open the door, and return whether the hand is on the leaf; if not, the result says why.

        Raises:
            DoorImpactError: The motion cannot begin.
        """
        if way.hit is None:
            assert way.opening.push is not None, "the leaf is held"
            return goal.dry_run or await self._reached(way, way.opening.push, result, stopped)
        touched = goal.probe == ExecuteDoorImpact.Goal.AUTO and not way.site.certain
        # The hit has the goal's identifier, by which the executor knows that it belongs to it.
        done = await self._hits.execute(
            ExecuteDoorImpact.Goal(plan_id=way.hit.plan_id, speed_scale=goal.speed_scale,
                                   probe=ExecuteDoorImpact.Goal.ON if touched else goal.probe,
                                   dry_run=goal.dry_run),
            goal_id, self._on_hit, stopped)
        if done.contact_sensor:
            for name in ("contact_time", "peak_angle", "held_angle"):
                setattr(result, name, getattr(done, name))
        if stopped() or not done.success:
            result.error_code = done.error_code or Result.STOPPED
            result.message = f"no passage follows the hit: {done.message}"
            return False
        return True

    async def _reached(
        self, way: Way, push: Push, result: Any, stopped: Callable[[], bool]
    ) -> bool:
        reaching = Reaching(self._robot, push.reach)
        await self._move(way, reaching, stopped)
        result.error_code, result.message = end_code(reaching), reaching.reason
        return bool(result.error_code == Result.NONE)
