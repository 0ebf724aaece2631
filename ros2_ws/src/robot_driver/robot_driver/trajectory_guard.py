"""Stands between the motions and the robot's controller, which follows whatever it gets.

A stock JointTrajectoryController checks no limits, forgets the present trajectory when a new one
arrives, and refuses one without points (`docs/hardware.md`).
"""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command, TrajectoryArrays
from humanoid_motion.splice import without_first

from robot_driver.trajectory_checks import JointLimits
from robot_driver.trajectory_driver import PERIOD, TrajectoryDriver

AWAY = 0.1  # largest distance of a joint from where the controller should hold it [rad]
_NEW_CLOCK = 1.0  # time by which the clock goes back where it was set anew [s]
_UNDERWAY = 0.1  # time after which the controller follows what it was sent [s]
_SAME = 0.01  # largest distance of the controller's reference from the known one [rad]


class TrajectoryGuard:
    """Knows what the controller follows, and sends it only what it can follow exactly.

    What is sent begins with the reference in force and ends at rest, has no jump and breaks no
    limit; a stop is two points. At first, and after others have moved the robot, the reference is
    not known: what is sent then begins with the trajectory's own first point, to which the
    controller goes on from where it is.

    Args:
        limits: Names and limits of the joints.
    """

    def __init__(self, limits: JointLimits) -> None:
        self._model = TrajectoryDriver(limits, np.zeros(len(limits.names)))
        self.forget()

    def forget(self) -> None:
        """Forget what the controller follows."""
        self._sure = math.inf  # time from which on that is known [s]
        self._sent = -math.inf  # when something was sent last [s]

    def follow(self, command: Command, now: float, position: Array | None) -> Command | None:
        """Return what the controller is to be sent.

        Args:
            command: What a motion wants.
            now: Present time of the robot's clock [s].
            position: Measured joint positions, (J,) [rad]; None: not known.

        Returns:
            The trajectory from now on; None where there is nothing that could be stopped.

        Raises:
            TrajectoryRefusedError: It breaks a limit, jumps, or comes too late; what the controller
                has goes on.
        """
        if not self._knows(now, position):
            self.forget()
        model, knots = self._model, command.knots
        if math.isinf(self._sure):
            if knots is None:
                return None
            model.reset(knots.position[0], now)
        model.accept(TrajectoryArrays.of(command, model.limits.names), command.stamp, now)
        rest = model.remaining(now)
        if now < self._sure:
            if math.isinf(self._sure):
                self._sure = now + float(rest.time[1])
            rest = without_first(rest.held_until(float(rest.time[-1]) + PERIOD))
        self._sent = now
        return Command(now, rest)

    def moving(self, now: float) -> bool:
        """Whether the controller has a trajectory that has not ended at a time [s]."""
        return not math.isinf(self._sure) and self._model.is_moving(now)

    def compare(self, stamp: float, reference: Array) -> str:
        """Compare what the controller says that it follows; believe it.

        Args:
            stamp: Time of its statement [s].
            reference: Joint positions, (J,) [rad].

        Returns:
            What is wrong with the trajectory under way; empty if nothing is, or none is under way.
        """
        if stamp < self._sent - _NEW_CLOCK:
            self.forget()
        if stamp < self._sent + _UNDERWAY:
            return ""
        known, moving = not math.isinf(self._sure), self._model.is_moving(stamp)
        off = np.abs(self._model.sample(stamp).position - reference)
        worst, why = int(np.argmax(off)), ""
        if known and moving and stamp >= self._sure:
            if off[worst] <= _SAME:
                return ""
            why = (f"the controller holds {self._model.limits.names[worst]} at "
                   f"{reference[worst]:.4f} rad, {off[worst]:.4f} rad from where the trajectory "
                   f"that it was sent is, at most {_SAME:g} rad are allowed: was it activated "
                   "anew, or does somebody else send trajectories?")
        elif known and moving:
            return ""
        self._model.reset(reference, stamp)
        self._sure = stamp
        return why

    def _knows(self, now: float, position: Array | None) -> bool:
        """Whether it is known what the controller follows, and the joints do not contradict."""
        if math.isinf(self._sure) or now < self._sent - _NEW_CLOCK:
            return False
        if position is None or self._model.is_moving(now):
            return True
        return bool(np.abs(position - self._model.sample(now).position).max() <= AWAY)
