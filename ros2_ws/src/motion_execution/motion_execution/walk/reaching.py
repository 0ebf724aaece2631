"""The execution of the hand's motion to the closed leaf, which ends where the hand meets it."""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import Measured
from robot_driver.motion import Outcome
from walking.passing.reach import Reach
from walking.passing.watch import Watch, WatchSettings

from motion_execution.walk.passage import AT_LEAF, STANDS
from motion_execution.walk.walk import Walk

TOUCHED = 5.0
"""Force on the hand above which it has met something, a mean over 20 ms [N]."""
_MOVED = math.radians(0.3)  # angle of the leaf beyond which it gives way to the hand [rad]
_BRAKE = 0.2  # time in which the robot comes to rest [s]


class Reaching(Walk):
    """One motion of the hand to the leaf. A stop, too, brings all joints to rest at once.

    Args:
        reach: The motion.

    Attributes:
        watch: The watch over leaf and hand.
        touched: Whether the hand has met something, or the leaf has moved.
        missed: Whether the motion has ended without that.
    """

    def __init__(self, robot: RobotModel, reach: Reach) -> None:
        super().__init__(robot, reach.walk, reach.pattern, AT_LEAF)
        self.watch = Watch(np.zeros_like, WatchSettings(_MOVED, 0.0, TOUCHED, 0.0))
        self.touched = self.missed = False

    def stage(self, now: float) -> str:
        """Return what happens: reach."""
        return "reach"

    def yields_at(self, now: float) -> bool:
        """Return that the hand is stiff, as before a passage after a hit."""
        return False

    def on_measured(self, now: float, measured: Measured) -> list[Command]:
        """Make no step after a push."""
        return []

    def on_door(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Handle an angle of the leaf [rad] with a stamp [s]."""
        self.touched |= bool(self.watch.on_door(now, angle))
        return []

    def on_hand(self, now: float, force: float) -> list[Command]:
        """Handle the magnitude of the force on the hand [N] with a stamp [s]."""
        self.touched |= bool(self.watch.on_hand(now, force))
        return []

    def on_joints(self, now: float, position: Array, velocity: Array) -> list[Command]:
        """Handle joint positions [rad] and speeds [rad/s], (J,) each; brake at the leaf."""
        commands = super().on_joints(now, position, velocity)
        begin = max(0.0, self.since(now + self.lag + self._settings.splice))
        brakes = begin >= self._knots.time[-1] - _BRAKE
        if not self.running or brakes or not (self.touched or self._stopping):
            return commands
        place, speed, bend = (rows[0] for rows in self._knots.at(begin))
        still = np.zeros_like(speed)
        self._knots = Knots(
            np.array([begin, begin + _BRAKE]), np.array([place, place + 0.5 * _BRAKE * speed]),
            np.array([speed, still]), np.array([bend, still]))
        return [Command(self._origin, self._knots)]

    def _at_rest(self, present: float) -> list[Command]:
        """End; without a contact as stopped."""
        commands = super()._at_rest(present)
        self.missed = self.outcome is Outcome.SUCCESS and not self.touched
        if self.missed:
            return self._ended(
                Outcome.STOPPED, f"the hand has not met the closed leaf: the force on it was at "
                f"most {self.watch.largest_force:.1f} N, more than {TOUCHED:g} N were expected; "
                f"{STANDS}")
        return commands
