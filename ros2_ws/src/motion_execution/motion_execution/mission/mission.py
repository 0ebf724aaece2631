"""The one who decides what moves the robot: hits, walks, and the way through a door.

A mission is what a node, a sweep, the draws of faults and a script run alike; what they differ in
is the `Link`. It is written as coroutines that wait for conditions (`routine`), because then the
order of what happens is the order of the lines.
"""

from __future__ import annotations

import math
from collections.abc import Coroutine, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from humanoid_motion.driver_interface import Command
from humanoid_motion.robot_model import RobotModel
from walking.errors import NotReady
from walking.footsteps.footstep import Pose
from walking.passing.settings import PassageSettings
from walking.pattern.walk_plan import WalkPlan

from motion_execution.hit.execution import Execution
from motion_execution.mission.body import Body
from motion_execution.mission.door_place import DoorPlace
from motion_execution.mission.hit_plan import HitPlan
from motion_execution.mission.hits import Hits
from motion_execution.mission.link import Link
from motion_execution.mission.order import Order
from motion_execution.mission.passing import Passed, Passing
from motion_execution.mission.routine import Routine
from motion_execution.mission.walks import Walks
from motion_execution.mission.ways import Wanted, Way, Ways
from motion_execution.settings import ExecutionSettings
from motion_execution.walk.goal import WalkGoal
from motion_execution.walk.walk import Walk

HIT, WALK, PASSAGE = "execute_door_impact", "walk", "walk_through_door"
PLAN_PASSAGE = "plan_door_passage"
_TELL = 0.05  # time between two reports of progress, by the robot's clock [s]
_BUSY = {  # what else may not begin, and why
    HIT: "a hit is being executed (execute_door_impact)",
    WALK: "the robot walks (walk)",
    PASSAGE: "the robot goes through the door (walk_through_door)",
    PLAN_PASSAGE: "a passage is being planned (plan_door_passage)",
}


class Mission:
    """Carries out orders, one motion at a time.

    Args:
        robot: The robot.
        link: Messages to and from the robot, and plans.
        survey: The door as it is to be seen from where a hit begins.
        passing: Settings of passages; None means the defaults.
        thresholds: Thresholds of hits; None means the defaults.
        recover: Whether a push on the standing robot makes it step.

    Attributes:
        body: The robot.
    """

    def __init__(
        self, robot: RobotModel, link: Link, survey: Pose, passing: PassageSettings | None = None,
        thresholds: ExecutionSettings | None = None, *, recover: bool = False,
    ) -> None:
        passing = passing or PassageSettings.of(robot)
        self._link = link
        self.body = Body(robot, link)
        ways = Ways(robot, link, passing, survey)
        self._hits = Hits(self.body, link, thresholds or ExecutionSettings.of(robot))
        place = DoorPlace(robot, link, survey)
        self._walks = Walks(self.body, link, place, recover=recover)
        self._passing = Passing(
            self.body, link, ways, self._hits, self._walks, passing, place)
        self._orders: list[Order] = []  # that are being carried out
        self._routines: list[Routine[Any]] = []
        self._told = -math.inf  # when the progress was told last, on the robot's clock [s]
        self._always = recover
        if recover:
            link.listen(on=True)

    # -- events ---------------------------------------------------------------------------------

    def run(self, coroutine: Coroutine[Any, None, Any]) -> Routine[Any]:
        """Begin a coroutine of this mission; it goes on with the events until it has ended."""
        routine = Routine[Any](coroutine)
        self._routines.append(routine)
        self.poll()
        return routine

    def poll(self) -> None:
        """Go on with what has come that somebody waits for."""
        for routine in list(self._routines):
            routine.poll()
        self._routines = [each for each in self._routines if not each.done]

    def after(self, now: float, commands: Sequence[Command]) -> None:
        """Send the commands that follow from an event, and go on.

        Args:
            now: Stamp of the event [s].
            commands: What the present motion has answered.
        """
        for command in commands:
            self.body.send(command)
        if commands and self._walks.guard.steps:
            self._link.say("a push on the standing robot makes it step", warning=True)
            self._link.show(self._walks.guard.steps)
        motion = self.body.motion
        order = next((each for each in self._orders if each.motion is not None), None)
        if motion is not None and order is not None and motion.running:
            if commands:
                motion.prepare_next()
            self._passing.yield_hand(motion, now)
            if not self._told <= now < self._told + _TELL:  # a reset sets the clock back
                self._told = now
                self._tell(order)
        self.poll()

    def _tell(self, order: Order) -> None:
        motion = order.motion
        progress: Any = None
        if order.action == PASSAGE:
            progress = self._passing.progress(order)
        elif isinstance(motion, Execution):
            progress = self._hits.progress(motion)
        elif isinstance(motion, Walk):
            progress = self._walks.progress(motion)
        if progress is not None:
            order.tell(progress)

    # -- orders ---------------------------------------------------------------------------------

    def stop(self) -> str:
        """Take all orders back, and return a sentence that says what happens.

        The motion under way ends as safely as it can. Only the next goal moves the robot again.
        """
        now = self._link.now()
        text = ("nothing is being executed" + (
            "; what the driver still follows is braked" if self.body.brake() else "")
            if not self._orders else "")
        for order in self._orders:
            motion = order.motion
            if isinstance(motion, Execution):
                past = motion.past_no_return(now)
                text = ("the point of no return has passed: the motion will be stopped after the "
                        "door's peak" if past else "the motion is being stopped")
            elif motion is not None:
                text = (f"{order.action} is being stopped: the robot finishes its step and stands "
                        "on two feet")
            else:
                text = text or f"{order.action} is being stopped before its next motion"
            order.stop()
        return text

    async def hit(
        self, plan: HitPlan, order: Order, *, probe: str = "auto", speed_scale: float = 1.0,
        dry_run: bool = False,
    ) -> Execution | None:
        """Execute a hit; arguments, result and errors are those of `Hits.make`."""
        with self._carried_out(order, but=()):
            return await self._hits.make(
                plan, order, probe=probe, speed_scale=speed_scale, dry_run=dry_run)

    async def walk(self, goal: WalkGoal, order: Order) -> Walk:
        """Walk; result and errors are those of `Walks.go`."""
        with self._carried_out(order, but=(WALK,)):
            return await self._walks.go(goal, order)

    async def plan_walk(self, goal: WalkGoal, order: Order) -> WalkPlan:
        """Plan a walk from where the robot stands; errors are those of `Walks.go`."""
        with self._carried_out(order, but=(WALK,)):
            return await self._walks.plan(goal, order)

    async def pass_door(self, wanted: Wanted, order: Order, passed: Passed) -> None:
        """Go through the door; arguments and errors are those of `Passing.go`."""
        with self._carried_out(order, but=()):
            await self._passing.go(wanted, order, passed)

    async def plan_passage(self, wanted: Wanted, order: Order) -> Way:
        """Plan the way through the door from where the robot is; errors as of `Passing.plan`."""
        with self._carried_out(order, but=(HIT, WALK)):
            return await self._passing.plan(wanted, order)

    def require_free(self, order: Order, but: Sequence[str] = ()) -> None:
        """Check that no other order moves the robot, but for actions that do not matter.

        Raises:
            NotReady: Another order moves the robot.
        """
        other = next((each for each in self._orders if each.action not in but), None)
        if other is not None:
            raise NotReady(f"{_BUSY[other.action]}: {order.action} begins when that has ended",
                           quantity="action", value=other.action)

    @contextmanager
    def _carried_out(self, order: Order, but: Sequence[str]) -> Iterator[None]:
        """Carry out an order; errors are those of `require_free`."""
        self.require_free(order, but)
        if not self._orders and not self._always:
            self._link.listen(on=True)
        self._orders.append(order)
        try:
            yield
        finally:
            self._orders.remove(order)
            if not self._orders and not self._always:
                self._link.listen(on=False)
