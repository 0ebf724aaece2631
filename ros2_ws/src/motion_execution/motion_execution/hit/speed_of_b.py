"""The speed of point B before and after the hit, from joints and gyro of the same tick."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
from door_impact_common.arrays import Array

_SAME_TICK = 0.003  # largest difference of stamps within one tick of the driver, of 5 ms [s]
_IN_CONTACT = 2  # number of the newest speeds, which may already be measured in the contact
_KEPT = 8  # number of speeds from which the mean is taken, with those that are left out


class SpeedOfB:
    """Pairs joint states with readings of the gyro, and calculates the speed of B from a pair.

    Args:
        speed: Function that returns the speed of B [m/s] from joint positions (J,) [rad], joint
            speeds (J,) [rad/s] and the IMU's angular velocity (3,) [rad/s].

    Attributes:
        joints: Stamp [s], positions [rad] and speeds [rad/s] of the last joint state; None before
            the first one.
        rate: Stamp [s] and angular velocity [rad/s] of the last reading of the gyro; None before
            the first one.
    """

    def __init__(self, speed: Callable[[Array, Array, Array], float]) -> None:
        self._speed = speed
        self._before: deque[float] = deque(maxlen=_KEPT)
        self._after: list[float] = []
        self.joints: tuple[float, Array, Array] | None = None
        self.rate: tuple[float, Array] | None = None

    def now(self) -> tuple[float, float] | None:
        """Return the stamp of the joints [s] and the speed of B [m/s].

        None is returned if joints and gyro are not of the same tick.
        """
        if self.joints is None or self.rate is None:
            return None
        (now, position, velocity), (at, rate) = self.joints, self.rate
        if abs(at - now) > _SAME_TICK:
            return None
        return now, self._speed(position, velocity, rate)

    def before_contact(self, speed: float) -> float:
        """Add a speed, and return the mean of the speeds before the contact [m/s].

        The newest speeds are left out of the mean, since the contact may have begun already.
        """
        self._before.append(speed)
        return float(np.mean([*self._before][:-_IN_CONTACT] or [*self._before]))

    def after_contact(self, speed: float) -> float:
        """Add a speed, and return the mean of the speeds after the contact [m/s]."""
        self._after.append(speed)
        return float(np.mean(self._after))
