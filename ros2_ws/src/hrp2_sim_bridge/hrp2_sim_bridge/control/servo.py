"""The reference of joints that get a command in each control period, as below a controller."""

from __future__ import annotations

from collections import deque

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.spline import JointReference
from robot_driver.errors import TrajectoryRefusedError
from robot_driver.trajectory_checks import JointLimits

from hrp2_sim_bridge.settings import TICK


class Servo:
    """Moves the joints from each command to the next one within a control period.

    Without a new command they stay where the last one was.

    Args:
        limits: Names and limits of the joints; the servo keeps only the ends of their ranges.
        position: Positions of the joints at rest at the start, (J,) [rad].
        delay: Number of periods by which commands are played back late.
    """

    def __init__(self, limits: JointLimits, position: Array, delay: int = 0) -> None:
        self.limits = limits
        self._delay = delay
        self.reset(position)

    def reset(self, position: Array, now: float = 0.0) -> None:
        """Rest at positions (J,) [rad] from a time [s] on, whatever was commanded."""
        self._before = self._here = np.array(position, dtype=float)
        self._period = now  # begin of the present one [s]
        self._waiting: deque[Array] = deque([self._here] * self._delay)
        self._next, self._last_way = self._here, np.zeros_like(self._here)

    def command(self, position: Array) -> None:
        """Command positions (J,) [rad] for the next period; none that is no number is taken."""
        if np.isfinite(position).all():
            self._next = np.clip(position, self.limits.lower, self.limits.upper)

    def sample(self, time: float) -> JointReference:
        """Return the reference at a time [s]; after the present period it is not known yet."""
        share = float(np.clip((time - self._period) / TICK, 0.0, 1.0))
        way = self._here - self._before
        return JointReference(
            self._before + share * way, way / TICK, (way - self._last_way) / TICK**2)

    def positions(self, times: Array) -> Array:
        """Return the positions (T, J) [rad] at times (T,) [s] of the next period."""
        if times[0] > self._period + 0.5 * TICK:
            self._waiting.append(self._next)
            self._last_way = self._here - self._before
            self._period, self._before = float(times[0]), self._here
            self._here = self._waiting.popleft()
        share = np.clip((times - self._period) / TICK, 0.0, 1.0)[:, None]
        return np.asarray(self._before + share * (self._here - self._before))

    def is_moving(self, time: float) -> bool:
        """Whether the last command moves a joint."""
        return bool((self._here != self._before).any())

    def accept(self, message: TrajectoryArrays, stamp: float, now: float) -> None:
        """Refuse a trajectory: a servo follows commands.

        Raises:
            TrajectoryRefusedError: Always.
        """
        raise TrajectoryRefusedError(
            "the joints follow the commands of a controller (servo), trajectories", "", 1, 0)

    def stop(self, now: float) -> None:
        """Stay where the joints are, until the next command."""
        self._waiting = deque([self._here] * self._delay)
        self._next = self._here
