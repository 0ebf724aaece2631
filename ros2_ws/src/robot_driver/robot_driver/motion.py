"""What every motion of the robot has in common: how it begins, how it ends, and its events."""

from __future__ import annotations

import enum

from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command
from humanoid_motion.samples import Measured


class Outcome(enum.Enum):
    """How a motion ended."""

    RUNNING = "running"
    SUCCESS = "success"
    NO_CONTACT = "no contact"
    STOPPED = "stopped"
    FELL = "fell"
    NOT_FOLLOWED = "not followed"
    NOT_HELD = "not held"
    LOCKED = "locked"
    LEAF_LOST = "leaf lost"


def silent(topic: str, waited: float, limit: float) -> str:
    """Reason for a topic without a message for a time that exceeds its limit, both in [s]."""
    return (f"no message has arrived on {topic} for {waited:.2f} s, at most {limit:g} s are "
            "allowed")


def failed(error: Exception) -> str:
    """Reason for an error of the program."""
    return f"the program failed: {type(error).__name__}: {error}"


class Motion:
    """A hit, a walk or a passage.

    It gets events and returns commands for the driver, in their order. Times are stamps of
    messages or times of the robot's clock, both in seconds.

    Attributes:
        outcome: How it ended; RUNNING before its end.
        reason: Sentence that explains the outcome; may be empty after a success and before the end.
        lag: Time by which the present event lags behind the present [s]; 0 if it is on time.
    """

    outcome = Outcome.RUNNING
    reason = ""
    lag = 0.0

    @property
    def running(self) -> bool:
        """Whether the motion has not ended yet."""
        return self.outcome is Outcome.RUNNING

    def start(self, now: float) -> Command:
        """Start at a time of the robot's clock [s], and return the first command."""
        raise NotImplementedError

    def stop(self, why: str = "") -> None:
        """Request the motion's own safe stop, which an event begins.

        Args:
            why: Sentence for `reason`; empty leaves the sentence to the motion.
        """
        raise NotImplementedError

    def give_up(self, why: str) -> None:
        """End as stopped, without a command: the driver finishes what it has."""
        if self.running:
            self.outcome, self.reason = Outcome.STOPPED, why

    def lags(self, seconds: float) -> None:
        """Set the time by which the next event lags behind the present [s], at least 0."""
        self.lag = seconds

    def prepare_next(self) -> None:
        """Do work that would delay a command, in the time between events."""

    def on_joints(self, now: float, position: Array, velocity: Array) -> list[Command]:
        """Handle joint positions [rad] and speeds [rad/s], (J,) each."""
        return []

    def on_imu(self, now: float, tilt: float, force: Array) -> list[Command]:
        """Handle the base's tilt [rad] and the specific force in the IMU's frame, (3,) [m/s^2]."""
        return []

    def on_wrenches(self, now: float, left: Array, right: Array) -> list[Command]:
        """Handle the floor's force and torque on both soles at one time, (6,) each [N, N m]."""
        return []

    def on_measured(self, now: float, measured: Measured) -> list[Command]:
        """Handle joints, IMU and wrenches of one time."""
        return []

    def on_door(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Handle angle [rad] and angular velocity [rad/s] of the door."""
        return []

    def on_hand(self, now: float, force: float) -> list[Command]:
        """Handle the magnitude of the force of the surroundings on the right hand [N]."""
        return []

    def on_silence(self, now: float, topic: str, waited: float, limit: float) -> list[Command]:
        """Handle a topic without a message for a time [s] that exceeds its limit [s]."""
        self.give_up(silent(topic, waited, limit))
        return []

    def on_refusal(self, now: float, why: str) -> list[Command]:
        """Handle a command that the controller does not follow, for a reason in words."""
        self.give_up(why)
        if self.outcome is Outcome.STOPPED:
            self.outcome = Outcome.NOT_FOLLOWED
        return []

    def on_failure(self, now: float, error: Exception) -> list[Command]:
        """Handle an error of the program: end the motion as safely as possible."""
        self.give_up(failed(error))
        return []
