"""The base of all states of an execution, and the state in which all of them end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command
from humanoid_motion.knots import Knots
from robot_driver.motion import Outcome

from motion_execution.hit.run import Run
from motion_execution.judge import fell, off_track


class Reaction(NamedTuple):
    """The answer of a state to an event.

    Attributes:
        state: State that follows.
        commands: Commands for the driver, in the order in which they must be sent.
    """

    state: State
    commands: Sequence[Command] = ()


class Reference(NamedTuple):
    """The trajectory that the driver follows.

    Attributes:
        stamp: Time of the robot's clock at which the time of the knots is 0 [s].
        knots: The trajectory.
    """

    stamp: float
    knots: Knots

    @property
    def end(self) -> float:
        """Time of the robot's clock at which the trajectory ends [s]."""
        return self.stamp + float(self.knots.time[-1])

    def from_here(self, now: float) -> Command:
        """Command with which the driver goes to the first posture until the trajectory begins."""
        return Command(now, replace(self.knots, time=self.knots.time + (self.stamp - now)))

    def position(self, now: float) -> Array:
        """Joint positions at a time of the robot's clock, (J,) [rad]."""
        return self.knots.at(now - self.stamp)[0][0]


@dataclass(frozen=True, kw_only=True)
class State:
    """A state of an execution, with the reactions that most states share.

    Each handler returns the state that follows the event, and the commands for the driver.

    Attributes:
        run: What all states of the execution share.
        phase: Name of the plan's phase.
        begin: Time at which the phase begins, on the robot's clock [s].
        end: Time at which the phase ends if no event ends it before, on the robot's clock [s].
        outcome: How the execution ended; RUNNING before its end.
        reason: Sentence that explains the outcome; may be empty after a success and before the
            end.
    """

    run: Run
    phase: str
    begin: float = np.inf
    end: float = np.inf
    outcome: Outcome = Outcome.RUNNING
    reason: str = ""

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Handle joint positions, (J,) [rad], and joint speeds, (J,) [rad/s], with a stamp [s]."""
        return Reaction(self)

    def on_foot_forces(self, now: float, force: float) -> Reaction:
        """Handle the floor's force on both feet towards the door [N], with a stamp [s]."""
        return Reaction(self)

    def on_specific_force(self, now: float, force: Array) -> Reaction:
        """Handle the specific force in the IMU's frame, (3,) [m/s^2], with a stamp [s]."""
        return Reaction(self)

    def on_door(self, now: float, angle: float, velocity: float) -> Reaction:
        """Handle an angle [rad] and an angular velocity [rad/s] of the door, with a stamp [s]."""
        return Reaction(self)

    def on_tilt(self, tilt: float) -> Reaction:
        """Handle a tilt of the trunk [rad]: stop the driver when the robot falls."""
        why = fell(tilt, self.run.settings.fall_tilt)
        return self.stop_driver(Outcome.FELL, why) if why else Reaction(self)

    def on_silence(self, now: float, why: str) -> Reaction:
        """Handle a topic without a message: stop the driver if the robot keeps its balance.

        Args:
            now: Time of the robot's clock [s].
            why: Sentence that names the topic.
        """
        if self.past_no_return(now):
            return self.give_up(f"the motion was given up in the phase {self.phase}, and the "
                                f"driver finishes the trajectory that it has: {why}")
        return self.stop_driver(
            Outcome.STOPPED, f"the motion was stopped in the phase {self.phase}: {why}")

    def past_no_return(self, now: float) -> bool:
        """Whether a stop at this time would lose balance, so that the hit must be completed."""
        return self.run.past_no_return(now)

    def progress(self, now: float) -> float:
        """Share of the phase that has passed, 0 to 1."""
        return float(np.clip((now - self.begin) / max(self.end - self.begin, 1e-9), 0.0, 1.0))

    # -- transitions to the end -----------------------------------------------------------------

    def give_up(self, reason: str) -> Reaction:
        """End as stopped, without a command to the driver."""
        return self.ended(Outcome.STOPPED, reason)

    def stop_driver(self, outcome: Outcome, reason: str) -> Reaction:
        """End, and command the driver's own stop."""
        return Reaction(self.ended(outcome, reason).state, (Command(0.0, None),))

    def ended(self, outcome: Outcome, reason: str) -> Reaction:
        """End without a command to the driver, which finishes its trajectory."""
        return Reaction(Ended(run=self.run, phase=self.phase, begin=self.begin, end=self.end,
                              outcome=outcome, reason=reason))


@dataclass(frozen=True, kw_only=True)
class Following(State):
    """A state in which the driver follows a trajectory.

    Attributes:
        sent: The trajectory that was sent last.
    """

    sent: Reference

    def compared(self, now: float, position: Array) -> Reaction:
        """Stop the driver if a joint is too far from the trajectory.

        Args:
            now: Stamp of the joint positions [s].
            position: Joint positions, (J,) [rad].
        """
        run = self.run
        why = off_track(position, self.sent.position(now), run.joint_names,
                        run.settings.tracking, "its trajectory is")
        if not why:
            return Reaction(self)
        return self.stop_driver(
            Outcome.NOT_FOLLOWED, f"the motion was stopped in the phase {self.phase}: {why}")


@dataclass(frozen=True, kw_only=True)
class Ended(State):
    """The execution is over: no event has an effect."""

    def on_tilt(self, tilt: float) -> Reaction:
        """Ignore the tilt."""
        return Reaction(self)

    def on_silence(self, now: float, why: str) -> Reaction:
        """Ignore a topic without a message."""
        return Reaction(self)

    def past_no_return(self, now: float) -> bool:
        """Whether a hit must be completed, which is never so after the end."""
        return False

    def ended(self, outcome: Outcome, reason: str) -> Reaction:
        """Keep the outcome and the reason."""
        return Reaction(self)
