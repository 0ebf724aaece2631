"""The execution of a walk: footsteps that newer ones may replace, and steps against pushes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from door_impact_common.errors import DoorImpactError
from humanoid_motion.driver_interface import Command
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import Measured
from robot_driver.motion import Outcome
from walking.errors import WalkInfeasible
from walking.footsteps.footstep import stances
from walking.passing.surroundings import Surroundings
from walking.pattern.plan import plan_walk
from walking.pattern.sections import rest_after
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState
from walking.pattern.walk_plan import WalkPlan
from walking.recovery.estimate import Balance, com_over_sole, watch
from walking.recovery.recovery import Recovery, recover

from motion_execution.settings import ExecutionSettings
from motion_execution.walk.stepping import Sent, Stepping

_TURNED = math.radians(0.5)  # turn of the leaf after which the way is looked at again [rad]


class Walk(Stepping):
    """One walk over footsteps.

    Args:
        plan: The walk, from rest.
        pattern: Settings with which it was planned.
        settings: Thresholds.
        onward: Function that plans how the walk goes on after a push has changed its steps and the
            robot stands again; None ends the walk there.
        around: Function that returns the door as it is now, which ends the walk if it comes into
            the way; None where nothing is known of it.

    Raises:
        DoorImpactError: The walk cannot begin: the robot could not come to rest before it.
    """

    def __init__(
        self, robot: RobotModel, plan: WalkPlan, pattern: WalkSettings | None = None,
        settings: ExecutionSettings | None = None,
        onward: Callable[[], WalkPlan] | None = None,
        around: Callable[[], Surroundings | None] = lambda: None,
    ) -> None:
        super().__init__(
            robot, plan, pattern or WalkSettings.of(robot), settings or ExecutionSettings())
        self._onward, self._around = onward, around
        self._clear_of = math.nan  # angle of the leaf that was last found clear of the way [rad]
        self._restarts = 0
        # Boundary beyond which no step is sent while others are planned, and the plan it is of.
        self._held: tuple[int, WalkPlan] | None = None
        self._following: tuple[int, WalkPlan] | None = None  # a boundary, and the plan from there
        self._recovery: Recovery | None = None  # that made the present plan
        self._seen: Balance | None = None  # at the last sample

    @property
    def steps(self) -> int:
        """Number of footsteps of the walk, with those that were made before they were replaced."""
        if self._following is None:
            return super().steps
        before, plan = self._following
        return self._sent.made + before + len(plan.footsteps)

    # -- requests --------------------------------------------------------------------------------

    def hold_for_new_footsteps(self, now: float) -> tuple[int, WalkState]:
        """Choose the boundary at which new footsteps begin, and make no step beyond it.

        Args:
            now: Time of the robot's clock [s].

        Returns:
            Number of footsteps of the present plan before the boundary, and the state there.
        """
        plan, step = self.plan, self._sent.steps
        soon = self.since(now) + self._settings.planning + self._settings.commit
        while step < len(plan.footsteps) and plan.begin_of(step) < soon:
            step += 1
        self._held = step, plan
        return step, plan.boundaries[step]

    def go_on(self) -> None:
        """Go on with the present footsteps: no new ones could be planned."""
        self._held = None

    def replace(self, step: int, plan: WalkPlan, now: float) -> bool:
        """Replace the footsteps beyond a boundary.

        Args:
            step: Number of footsteps before it, of `hold_for_new_footsteps`.
            plan: Walk from the state there.
            now: Time of the robot's clock [s].

        Returns:
            Whether it was in time; if not, the robot comes to rest at the boundary.
        """
        same = self._held is not None and self._held[1] is self.plan  # no push has changed it
        if self._stopping or not same or not self.running or self._sent.steps > step:
            return False
        until = self.plan.begin_of(step) + self._settings.latest
        if self.since(now) + self._settings.splice > until:
            return False
        self._following = step, plan
        return True

    def resume(self, plan: WalkPlan, now: float) -> Command:
        """Walk on after a rest.

        Args:
            plan: Walk from the state `final`.
            now: Time of the robot's clock [s].

        Raises:
            DoorImpactError: The robot could not come to rest before the first step.
        """
        self._begin(replace(self._unsent(plan), made=self.steps_sent))
        self._held = self._recovery = self._seen = None
        return self.start(now)

    # -- events ----------------------------------------------------------------------------------

    def on_measured(self, now: float, measured: Measured) -> list[Command]:
        """Change the steps if a push has moved the capture point too far.

        Args:
            now: Stamp of the measurements, which belong together [s].
            measured: Joints, IMU and wrenches of the feet.
        """
        sent = self._sent
        late = self.lag > 0.0  # a changed step that comes late makes the fall worse
        if not self.running or now < sent.origin or late or self.resting(now):
            return []
        plan, origin = sent.plan, sent.origin
        if now >= sent.boundary:
            plan, origin = sent.rest.plan, sent.boundary - sent.rest.begin
        time = now - origin
        self._seen = watch(self._robot, plan, time, measured, before=self._seen)
        if self._may_have_missed(now, self._seen):
            return []
        found = recover(
            self._robot, plan, time, measured, walk=self._pattern, previous=self._recovery,
            seen=self._seen)
        if found is None:
            return []
        self.recovered += 1
        self._recovery = found
        steps = len(found.plan.footsteps)
        self._begin(Sent(
            found.plan, rest_after(self._robot, found.plan, steps, self._pattern),
            found.plan.knots, steps, origin + found.begin, sent.landed(now)))
        return [self._sent.command]

    def on_door(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Come to rest before a leaf that has moved into the way."""
        if self._stopping or abs(angle - self._clear_of) < _TURNED:
            return []
        around, sent = self._around(), self._sent
        if around is None:
            return []
        self._clear_of = angle
        ahead = stances(sent.plan.schedule.phases[0].stance, sent.plan.footsteps)
        try:
            around.require_way([each.middle for each in ahead[max(0, sent.steps - 1):]])
        except WalkInfeasible as error:
            self.stop(f"the robot has come to rest: {error}")
        return []

    def _under_way(self, present: float) -> list[Command]:
        """Go over to new footsteps at their boundary, and send the next step if it is not held."""
        sent = self._sent
        if self._following is not None and sent.steps == self._following[0]:
            begin = sent.plan.begin_of(sent.steps)
            knots = replace(sent.knots, time=sent.knots.time - begin)
            self._begin(Sent(self._following[1], sent.rest, knots, 0, sent.boundary,
                             self.steps_sent, sent.phase(sent.boundary - 1e-6)))
            self._held = None
        if self._held is not None and self._sent.steps >= self._held[0]:
            return []
        return super()._under_way(present)

    def _at_rest(self, present: float) -> list[Command]:
        """End a walk that has come to rest, or take it up again."""
        if self._stopping or (self._sent.complete and self._recovery is None):
            return super()._at_rest(present)
        if self._held is not None:
            return []  # new footsteps are being planned
        if self._restarts == self._settings.restarts:
            return self._ended(
                Outcome.STOPPED, f"the walk came to rest {self._restarts + 1} times because "
                "messages were late, the computer was busy, or the robot was pushed")
        if self._recovery is not None and self._onward is None:
            return self._ended(Outcome.STOPPED, "a push has changed the steps; the robot stands")
        self._restarts += 1
        try:
            if self._recovery is not None and self._onward is not None:
                again = self._onward()
            else:
                left = self.plan.footsteps[self._sent.steps:]
                again = plan_walk(self._robot, self.final, left, self._pattern)
            return [self.resume(again, present)]
        except DoorImpactError as error:
            return self._ended(Outcome.STOPPED, f"the walk came to rest and cannot go on: {error}")

    def _begin(self, sent: Sent) -> None:
        """Go over to another plan."""
        self._sent = sent
        self._following = self._next_rest = self._had = None

    def _may_have_missed(self, now: float, seen: Balance) -> bool:
        """Whether the robot's balance is rather that of a step whose motion came too late."""
        if self._had is None or seen.phase.kind != "single":
            return False
        position, velocity, _ = self._had.knots.at(self.since(now))
        side = seen.phase.sides[0]
        had = com_over_sole(self._robot, side, seen.phase.stance.foot(side), position[0],
                            velocity[0], None).capture_point
        to_last, to_sent = (np.linalg.norm(seen.capture_point - point)
                            for point in (had, seen.planned))
        return bool(to_last < to_sent)
