"""The states of an execution after the door's peak: the hold and the retreat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from robot_driver.motion import Outcome

from motion_execution.hit import reasons
from motion_execution.hit.state import Following, Reaction
from motion_execution.judge import off_track


@dataclass(frozen=True, kw_only=True)
class _Ending(Following):
    """A motion after the door's peak, which can be stopped at any time."""

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """End if a stop is requested, or judge the motion when its time is over."""
        run = self.run
        if run.stop_requested:
            return self.stop_driver(Outcome.STOPPED, reasons.stopped(self.phase))
        if now < self.end:
            return Reaction(self)
        why = off_track(position, self.sent.knots.position[-1], run.joint_names,
                        run.settings.tracking, f"the {self.phase} ends")
        if why:
            return self.ended(Outcome.NOT_FOLLOWED, why)
        return self._judged()

    def past_no_return(self, now: float) -> bool:
        """Return False: in this state the robot keeps its balance in a stop."""
        return False

    def _judged(self) -> Reaction:
        """End the motion, which the joints have followed."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Hold(_Ending):
    """The hand catches the door and holds it."""

    def _judged(self) -> Reaction:
        """End with success if the door stands still, and where it is to be pushed back to."""
        run, plan, angles = self.run, self.run.plan, self.run.door_angles
        run.measured.held_angle = float(np.mean(angles))
        return self.ended(*reasons.held_verdict(
            angles, plan.held_angle, run.settings.held_within,
            anywhere=plan.held_angle < plan.desired_angle))


@dataclass(frozen=True, kw_only=True)
class Retreat(_Ending):
    """The robot goes back from the door.

    Attributes:
        outcome_at_end: Outcome of the execution if the joints follow the retreat.
        reason_at_end: Sentence that explains this outcome.
    """

    outcome_at_end: Outcome
    reason_at_end: str

    def _judged(self) -> Reaction:
        """End with the outcome that the retreat began with."""
        return self.ended(self.outcome_at_end, self.reason_at_end)
