"""Opens the door for the node door_passer: by a hit, or by the hand on the closed leaf."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from door_impact_common.arrays import Array
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan
from humanoid_motion.robot_model import RobotModel

from walking.execution.reaching import Reaching
from walking.footsteps.footstep import Pose
from walking.passing.held import Hold
from walking.passing.opening import Opening, Push
from walking.passing.passage import PassagePlan
from walking.ros.hit_client import HitClient
from walking.ros.passage_planner import PassagePlanner, never
from walking.ros.passer_messages import Result, end_code


@dataclass(frozen=True)
class Way:
    """A way through the closed door.

    Attributes:
        door: Name of the door.
        opening: How the leaf is opened, and why.
        hold: How that is planned to end.
        passage: The passage from there.
        hit: Plan of the hit; None if the leaf is pushed.
    """

    door: str
    opening: Opening
    hold: Hold
    passage: PassagePlan
    hit: ImpactPlan | None = None


class Openings:
    """Plans and makes what opens the door.

    Args:
        robot: The robot.
        planner: Plans hits and passages.
        hits: Executes hits.
        hinge: Surveyed x and y of the hinge in odom, (2,) [m].
        move: Makes a motion, until it has ended or a function says that it is not wanted.
        on_hit: Function that gets the feedback of a hit.
    """

    def __init__(
        self, robot: RobotModel, planner: PassagePlanner, hits: HitClient, hinge: Array,
        move: Callable[[Reaching, Callable[[], bool]], Awaitable[None]],
        on_hit: Callable[[Any], None],
    ) -> None:
        self._robot, self._planner, self._hits, self._hinge = robot, planner, hits, hinge
        self._move, self._on_hit = move, on_hit

    async def plan(
        self, wanted: Any, middle: Pose, stopped: Callable[[], bool] = never
    ) -> Way:
        """Plan the way through the door.

        Args:
            wanted: A goal or a request.
            middle: Middle between the soles of the robot, which stands in half-sitting.
            stopped: Whether the way is not wanted any more.

        Raises:
            DoorImpactError: There is none.
        """
        door, opening = await self._planner.opening(wanted, self._hinge, middle, stopped)
        push = opening.push
        if push is not None:
            return Way(door, opening, push.hold, push.passage)
        hit, hold, passage = await self._planner.hit_and_passage(wanted, stopped)
        return Way(hit.door, opening, hold, passage, hit)

    async def make(
        self, way: Way, goal: Any, goal_id: Any, result: Any, stopped: Callable[[], bool]
    ) -> bool:
        """Open the door, and return whether the hand is on the leaf; if not, the result says why.

        Raises:
            DoorImpactError: The motion cannot begin.
        """
        if way.hit is None:
            return goal.dry_run or await self._reached(way.opening.push, result, stopped)
        # The hit has the goal's identifier, by which the executor knows that it belongs to it.
        done = await self._hits.execute(
            ExecuteDoorImpact.Goal(plan_id=way.hit.plan_id, speed_scale=goal.speed_scale,
                                   probe=goal.probe, dry_run=goal.dry_run),
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
        self, push: Push | None, result: Any, stopped: Callable[[], bool]
    ) -> bool:
        assert push is not None, "neither hit nor push"
        reaching = Reaching(self._robot, push.reach)
        await self._move(reaching, stopped)
        result.error_code, result.message = end_code(reaching), reaching.reason
        return bool(result.error_code == Result.NONE)
