"""Executes walks, of which a newer one takes the place of the one under way."""

from __future__ import annotations

import math
from dataclasses import dataclass

from walking.errors import NotReady
from walking.footsteps.footstep import Pose
from walking.pattern.fold import plan_fold
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState, standing
from walking.pattern.walk_plan import WalkPlan

from motion_execution.mission.body import PATIENCE, Body
from motion_execution.mission.door_place import DoorPlace
from motion_execution.mission.errors import MotionFailed, Replaced
from motion_execution.mission.link import Link, Pending
from motion_execution.mission.order import Order, result_of
from motion_execution.mission.routine import until
from motion_execution.walk.goal import WalkGoal, plan_goal
from motion_execution.walk.guard import Guard
from motion_execution.walk.start import NEAR, require_near, start_state
from motion_execution.walk.walk import Walk

FOLDED = 0.3  # time at rest with folded arms before a walk is planned [s]


@dataclass(frozen=True)
class WalkProgress:
    """How far a walk has come; the names are those of the action's feedback.

    Attributes:
        step: Footstep that is being made, from 1; 0 before the first one.
        steps: Number of footsteps.
        pose: Middle between the soles in odom, by the odometry.
        zmp_margin: Distance of the last ZMP from the edge of the soles that should bear load [m].
    """

    step: int
    steps: int
    pose: Pose
    zmp_margin: float


class Walks:
    """Executes walks.

    Args:
        body: The robot.
        link: Messages and plans.
        place: Where the door stands.
        recover: Whether a push on the standing robot makes it step.

    Attributes:
        guard: Answers such pushes.
    """

    def __init__(
        self, body: Body, link: Link, place: DoorPlace, *, recover: bool = False
    ) -> None:
        self._body, self._link, self._place = body, link, place
        self._settings = WalkSettings.of(body.model)
        self._walk: Walk | None = None  # that was begun last
        self._owner: Order | None = None  # whose walk it is
        self._newest: Order | None = None  # that was accepted last
        self._wanted = WalkGoal(Pose(0.0, 0.0, 0.0))  # of the walk under way
        self._folding = False
        self.guard = Guard(body.model, lambda: recover and body.motion is None, self.state)
        if recover:
            body.idle = body.inputs.motion = self.guard

    @property
    def walking(self) -> Walk | None:
        """The walk under way; None: none."""
        walk = self._walk
        return walk if walk is not None and walk.running else None

    async def go(self, goal: WalkGoal, order: Order) -> Walk:
        """Walk, and return the walk after its end.

        Raises:
            DoorImpactError: The walk cannot be made.
            Replaced: A newer goal took the place of this one.
            Stopped: The order was taken back before the first step.
        """
        self._newest = order
        await self._ready(order)
        while (walk := self.walking) is not None:
            if await self._replaced(order, goal, walk):
                return await self._owned(order, walk)
        await self._fold(order)
        plan = await self._planned(goal, order)
        self._require_newest(order)
        if self.walking is not None or self.guard.steps:
            raise NotReady("another motion began while the walk was planned")
        walk = self._walk = Walk(
            self._body.model, plan, self._settings, onward=self._onward,
            around=self._place.around)
        self._wanted = goal
        self._link.show(plan.footsteps)
        self._body.begin(order, walk, walk.start(self._link.now() + self._body.inputs.lag))
        return await self._owned(order, walk)

    async def plan(self, goal: WalkGoal, order: Order) -> WalkPlan:
        """Return what `go` would do from where the robot stands; errors are the same."""
        await self._ready(order)
        return await self._planned(goal, order)

    def progress(self, walk: Walk) -> WalkProgress | None:
        """Return how far a walk has come; None where the odometry is not known."""
        now, soles = self._link.now(), self._body.soles()
        if soles is None:
            return None
        return WalkProgress(min(walk.steps_sent, walk.steps_made(now) + 1), walk.steps,
                            soles.middle, self._body.walk_margin(walk, now))

    def state(self) -> WalkState:
        """Return the state in which a walk from the present posture begins.

        Raises:
            NotReady: Messages are missing or old, or the robot does not stand still.
        """
        body = self._body
        return start_state(body.model, body.standing(), self._settings, body.commanded)

    async def _ready(self, order: Order) -> None:
        # After a reset, or when the first goal has just subscribed.
        await self._body.wait(lambda: self._body.heard(), PATIENCE, order)
        await self._body.wait(
            lambda: not self.guard.steps and not self._folding, math.inf, order)

    async def _fold(self, order: Order) -> None:
        """Fold the arms to the sides if they are held out, which lets a leaf in the hand go.

        Raises:
            NotReady: The leaf would shut onto the robot.
            MotionFailed: The arms are not folded.
        """
        state = self.state()
        if not self._holds_out(state):
            return
        self._folding = True
        try:
            plan = await self._checked(
                self._link.compute(plan_fold, state, self._settings), order)
            motion = Walk(self._body.model, plan, self._settings)
            self._body.begin(
                order, motion, motion.start(self._link.now() + self._body.inputs.lag))
            await self._body.ended(order)
        finally:
            self._folding = False
        MotionFailed.check(motion, "no walk follows the folding of the arms: ")
        await self._body.rest(FOLDED, order)
        self._require_newest(order)

    def _holds_out(self, state: WalkState) -> bool:
        """Return whether arms are held out, and are folded before a walk.

        Raises:
            NotReady: The leaf would shut onto the robot then.
        """
        around = self._place.around()
        out = self._body.model.folded_by(state.upper.value) > NEAR
        if out and around is not None:
            around.require_let_go(state.stance.middle)
        return out

    async def _planned(self, goal: WalkGoal, order: Order) -> WalkPlan:
        """Plan the walk from where the robot stands."""
        state, around = self.state(), self._place.around()
        if self._holds_out(state):
            state = standing(self._body.model, state.stance)
            return await result_of(self._link.compute(
                plan_goal, state, goal, self._settings, "", around), order)
        return await self._checked(self._link.compute(
            plan_goal, state, goal, self._settings, "", around), order)

    async def _checked(self, pending: Pending, order: Order) -> WalkPlan:
        """Return a plan from where the robot stands, when it is known that it stands there."""
        plan: WalkPlan = await result_of(pending, order)
        await self._body.caught_up(order)
        joints = self._body.inputs.joints
        if joints is None:
            raise NotReady("the robot's clock went back while the walk was planned")
        require_near(self._body.model, plan.knots.position[0], joints[1])
        return plan

    async def _owned(self, order: Order, walk: Walk) -> Walk:
        """Make an order the owner of the walk under way, and wait for its end."""
        if self._owner is not None:
            self._owner.motion = None
        self._owner, order.motion = order, walk
        await until(lambda: not walk.running or self._owner is not order)
        if self._owner is not order:
            raise Replaced("a newer goal took the place of this one",
                           value=walk.steps_made(self._link.now()))
        self._owner = None
        await self._body.ended(order)
        return walk

    def _onward(self) -> WalkPlan:
        """Plan how a walk goes on from where a push and the steps against it have left the robot.

        Raises:
            DoorImpactError: The robot does not stand, or the goal cannot be reached from here.
        """
        if self._wanted.footsteps:
            raise NotReady("a push has changed the steps, so that the goal's footsteps do not fit "
                           "any more")
        plan = plan_goal(self._body.model, self.state(), self._wanted, self._settings,
                         around=self._place.around())
        self._link.show(plan.footsteps)
        return plan

    async def _replaced(self, order: Order, goal: WalkGoal, walk: Walk) -> bool:
        """Plan new footsteps from a boundary of the walk under way, and put them in their place.

        Returns:
            Whether the walk goes on with them; if not, it has ended meanwhile.

        Raises:
            DoorImpactError: They cannot be made; the walk under way goes on with its own.
        """
        now = self._link.now
        step, state = walk.hold_for_new_footsteps(now())
        before = walk.plan.footsteps[step - 1].side if step else ""
        try:
            plan = await self._new(order, goal, state, before)
            if not walk.replace(step, plan, now()):
                # Too late: the robot comes to rest at the boundary, and walks on from there.
                await self._body.wait(
                    lambda: not walk.running or walk.resting(now()), math.inf, order)
                if not walk.running:
                    return False
                # As planned, or as found if the robot was pushed.
                plan = await self._new(
                    order, goal, self.state() if walk.recovered else walk.final)
                if not walk.running:
                    return False
                self._body.send(walk.resume(plan, now()))
        except Exception as error:
            if self._newest is order:  # otherwise the newest goal holds the walk
                walk.go_on()
                if walk.running and not order.stopped:
                    error.args = (f"{error}; the walk under way goes on",)
            raise
        self._wanted = goal
        self._link.show(plan.footsteps)
        return True

    async def _new(
        self, order: Order, goal: WalkGoal, state: WalkState, before: str = ""
    ) -> WalkPlan:
        pending = self._link.compute(plan_goal, state, goal, self._settings, before,
                                     self._place.around())
        await self._body.wait(pending.done, math.inf, order)
        self._require_newest(order)
        plan: WalkPlan = pending.result()
        return plan

    def _require_newest(self, order: Order) -> None:
        if self._newest is not order:
            raise Replaced("a newer goal took the place of this one before its first step", value=0)
