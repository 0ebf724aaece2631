"""The execution of a passage: a walk, and the watch over leaf and hand."""

from __future__ import annotations

import math

from humanoid_motion.driver_interface import Command
from humanoid_motion.robot_model import RobotModel
from robot_driver.motion import Outcome
from walking.passing.passage import PassagePlan
from walking.passing.watch import Watch, WatchSettings

from motion_execution.settings import ExecutionSettings
from motion_execution.walk.stepping import Stepping

STANDS = "the robot stands"
AT_LEAF = ExecutionSettings(lead=0.2, commit=0.35)
"""Thresholds of motions that begin in the posture that was commanded last.

The driver therefore joins sooner than in a walk. Each step is sent earlier: a passage that came to
rest because a message was late is not taken up again, as the leaf would not wait.
"""


class Passage(Stepping):
    """One passage. A stop finishes the step, and the hand comes to rest where it is on the leaf.

    It ends with LEAF_LOST where the leaf was not where it should be. A push does not change the
    steps: the hand could not follow others.

    Args:
        plan: The passage.
        yields: Whether the driver lets the hand yield, so that its arm leaves the trajectory.
        limits: Limits of what leaf and hand may do; None means the defaults.

    Attributes:
        passage: The plan.
        watch: The watch over leaf and hand.
        release_angle: Angle of the leaf when the hand let it go [rad]; NaN before.

    Raises:
        DoorImpactError: The passage cannot begin: the robot could not come to rest before it.
    """

    def __init__(
        self, robot: RobotModel, plan: PassagePlan, *, yields: bool,
        limits: WatchSettings | None = None,
    ) -> None:
        super().__init__(robot, plan.walk, plan.pattern, AT_LEAF,
                         free=robot.arm_columns.tolist() if yields else ())
        self.passage = plan
        self.watch = Watch(plan.push.at, limits)
        self.release_angle = math.nan

    def stage(self, now: float) -> str:
        """Return what happens at a time of the robot's clock [s]: push, walk or square_up."""
        if self.since(now) < self.passage.push.end:
            return "push"
        return "square_up" if self._released(now) else "walk"

    def yields_at(self, now: float) -> bool:
        """Return whether the hand should yield at a time of the robot's clock [s].

        Up to the release the plan has it behind the leaf's face by its force over the stiffness.
        """
        return 0.0 <= self.since(now) <= self.passage.push.release

    def cleared(self, now: float) -> float:
        """Return when the robot was clear of wall and leaf, by the robot's clock [s]; NaN: not yet.

        Args:
            now: Time of the robot's clock [s].
        """
        clear = now - self.since(now) + self.passage.clear
        way = self.passage.route.clear
        return clear if now >= clear and self.steps_made(now) >= way else math.nan

    def on_door(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Handle an angle of the leaf [rad] with a stamp [s]."""
        time = self.since(now)
        if self._released(now):
            self.release_angle = angle if math.isnan(self.release_angle) else self.release_angle
        elif 0.0 <= time <= self.passage.push.release and self._goes_on:
            why = self.watch.on_door(time, angle)
            if why:
                self._end_at_rest(Outcome.LEAF_LOST, f"{why}; {STANDS}")
        return []

    def on_hand(self, now: float, force: float) -> list[Command]:
        """Handle the magnitude of the force on the hand [N] with a stamp [s]."""
        if self.since(now) >= 0.0 and self._goes_on:
            why = self.watch.on_hand(self.since(now), force)
            if why:
                self.stop(f"{why}; {STANDS}")
        return []

    @property
    def _goes_on(self) -> bool:
        """Whether the plan is being followed: a stopping robot does not move the leaf any more."""
        return self.running and not self._stopping

    def _released(self, now: float) -> bool:
        """Return whether the hand has let the leaf go at a time [s], as far as steps were sent."""
        release, sent = self.passage.push.release, self._sent
        ahead = sent.complete or self.plan.begin_of(sent.steps) > release
        return ahead and self.since(now) > release
