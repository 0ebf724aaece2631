"""Speed of point B around the hit, from joints and gyro of the same tick."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
from door_impact_common.arrays import Array

_SAME_TICK = 0.003  # between stamps of joints and gyro of one tick of 5 ms [s]
_IN_CONTACT = 2  # newest speeds, which may be of the contact already
_KEPT = 8


class SpeedOfB:
    """Pairs what joints and gyro say.

    Args:
        speed: Of B [m/s] from joint positions, joint speeds and angular velocity of the IMU, (30,),
            (30,) and (3,).

    Attributes:
        joints: Stamp [s], positions [rad] and speeds [rad/s] that were heard last; None: none.
        rate: Stamp [s] and angular velocity [rad/s] of the IMU; None: none.
    """

    def __init__(self, speed: Callable[[Array, Array, Array], float]) -> None:
        self._speed = speed
        self._before: deque[float] = deque(maxlen=_KEPT)
        self.joints: tuple[float, Array, Array] | None = None
        self.rate: tuple[float, Array] | None = None

    def now(self) -> tuple[float, float] | None:
        """Stamp of the joints [s] and speed [m/s]; None where the two are not of one tick."""
        if self.joints is None or self.rate is None:
            return None
        (now, position, velocity), (at, rate) = self.joints, self.rate
        if abs(at - now) > _SAME_TICK:
            return None
        return now, self._speed(position, velocity, rate)

    def before_contact(self, speed: float) -> float:
        """Mean of the last speeds with a new one, without those that may be of a contact [m/s]."""
        self._before.append(speed)
        return float(np.mean([*self._before][:-_IN_CONTACT] or [*self._before]))
