"""Watches leaf and hand while the robot passes the door.

Times count from the beginning of the passage.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

_MEAN = 0.02  # time over which the hand's force is averaged [s]


@dataclass(frozen=True)
class WatchSettings:
    """Limits of what leaf and hand may do.

    Attributes:
        leaf_error: Largest distance of the leaf's angle from the plan while it is held [rad].
        leaf_time: Time for which it must be exceeded, after which the leaf is lost [s].
        hand_force: Largest force on the hand [N].
        hand_time: Time for which it must be exceeded, after which the robot stops [s].
    """

    leaf_error: float = math.radians(8.0)
    leaf_time: float = 0.2
    hand_force: float = 150.0
    hand_time: float = 0.1


class Watch:
    """Judges what encoder and wrist measure against the plan.

    Args:
        planned: Function that returns the leaf's planned angles at times, (N,) [rad].
        settings: Limits; None means the defaults.

    Attributes:
        largest_force: Largest force on the hand, a mean over 20 ms [N]; NaN: not measured.
        largest_error: Largest distance of the held leaf's angle from the plan [rad]; NaN: not
            measured.
    """

    def __init__(
        self, planned: Callable[[Array], Array], settings: WatchSettings | None = None
    ) -> None:
        self._planned = planned
        self._settings = settings or WatchSettings()
        self._off = _Lasting(self._settings.leaf_time)
        self._pressed = _Lasting(self._settings.hand_time)
        self._forces: deque[tuple[float, float]] = deque()
        self.largest_force = self.largest_error = math.nan

    def on_door(self, time: float, angle: float) -> str:
        """Judge an angle of the held leaf [rad] that was measured at a time [s].

        Returns:
            Why the leaf is lost; empty while it is where the hand keeps it.
        """
        error = angle - float(self._planned(np.array([time]))[0])
        self.largest_error = float(np.fmax(self.largest_error, abs(error)))
        limit = self._settings.leaf_error
        if not self._off.judge(time, abs(error) > limit):
            return ""
        return (f"the leaf is lost: it has been {math.degrees(abs(error)):.1f} deg "
                f"{'ahead of' if error > 0.0 else 'behind'} the plan at {math.degrees(angle):.1f} "
                f"deg, more than {math.degrees(limit):g} deg for {self._settings.leaf_time:g} s")

    def on_hand(self, time: float, force: float) -> str:
        """Judge a force on the hand [N] that was measured at a time [s].

        Returns:
            Why the robot must stop; empty while the force is small enough.
        """
        self._forces.append((time, force))
        while self._forces[0][0] <= time - _MEAN:
            self._forces.popleft()
        mean = float(np.mean([value for _, value in self._forces]))
        self.largest_force = float(np.fmax(self.largest_force, mean))
        limit = self._settings.hand_force
        if not self._pressed.judge(time, mean > limit):
            return ""
        return (f"the force on the hand has been {mean:.0f} N, more than {limit:g} N for "
                f"{self._settings.hand_time:g} s")


class _Lasting:
    """Whether something has held for a time [s] without interruption."""

    def __init__(self, limit: float) -> None:
        self._limit, self._since = limit, math.nan

    def judge(self, time: float, holds: bool) -> bool:
        if not holds:
            self._since = math.nan
        elif math.isnan(self._since):
            self._since = time
        return holds and time - self._since >= self._limit
