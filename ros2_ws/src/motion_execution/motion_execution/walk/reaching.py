"""The execution of the hand's motion to the closed leaf, which ends where the hand meets it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from humanoid_motion.driver_interface import Command
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel
from robot_driver.motion import Outcome
from walking.passing.reach import Reach
from walking.passing.watch import Watch, WatchSettings

from motion_execution.walk.passage import AT_LEAF, STANDS
from motion_execution.walk.stepping import Stepping

TOUCHED = 5.0
"""Force on the hand above which it has met something, a mean over 20 ms [N]."""
_MOVED = math.radians(0.3)  # angle of the leaf beyond which it gives way to the hand [rad]
_BRAKE = 0.2  # time in which the robot comes to rest [s]


class Reaching(Stepping):
    """One motion of the hand to the leaf. A stop, too, brings all joints to rest at once.

    It ends with NO_CONTACT where the hand meets nothing.

    Args:
        reach: The motion, without footsteps.

    Attributes:
        watch: The watch over leaf and hand.
        touched: Whether the hand has met something, or the leaf has moved.
    """

    def __init__(self, robot: RobotModel, reach: Reach) -> None:
        super().__init__(robot, reach.walk, reach.pattern, AT_LEAF)
        self.watch = Watch(np.zeros_like, WatchSettings(_MOVED, 0.0, TOUCHED, 0.0))
        self.touched = False

    def stage(self, now: float) -> str:
        """Return what happens: reach."""
        return "reach"

    def yields_at(self, now: float) -> bool:
        """Return that the hand is stiff, as before a passage after a hit."""
        return False

    def on_door(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Handle an angle of the leaf [rad] with a stamp [s]."""
        self.touched |= bool(self.watch.on_door(now, angle))
        return []

    def on_hand(self, now: float, force: float) -> list[Command]:
        """Handle the magnitude of the force on the hand [N] with a stamp [s]."""
        self.touched |= bool(self.watch.on_hand(now, force))
        return []

    def _under_way(self, present: float) -> list[Command]:
        """Brake at the leaf, or after a stop."""
        begin = max(0.0, self.since(present + self._settings.splice))
        brakes = begin >= self._sent.knots.time[-1] - _BRAKE
        if brakes or not (self.touched or self._stopping):
            return []
        place, speed, bend = (rows[0] for rows in self._sent.knots.at(begin))
        still = np.zeros_like(speed)
        self._sent = replace(self._sent, knots=Knots(
            np.array([begin, begin + _BRAKE]), np.array([place, place + 0.5 * _BRAKE * speed]),
            np.array([speed, still]), np.array([bend, still])))
        return [self._sent.command]

    def _at_rest(self, present: float) -> list[Command]:
        """End; without a contact as such."""
        if self.touched or self._stopping:
            return super()._at_rest(present)
        return self._ended(
            Outcome.NO_CONTACT, "the hand has not met the closed leaf: the force on it was at most "
            f"{self.watch.largest_force:.1f} N, more than {TOUCHED:g} N were expected; {STANDS}")
