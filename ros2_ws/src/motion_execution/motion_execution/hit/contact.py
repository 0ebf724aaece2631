"""Detects the contact of elbow and leaf: from the trunk's accelerometer, the feet and the door.

The trunk loses its speed within some 15 ms, on a smooth leaf as well, so that the accelerometer
shows the contact first. Where it is missing, the feet show a contact on a leaf with friction, which
turns the robot, and the door's encoder shows the others, later.
"""

from __future__ import annotations

import enum
from collections import deque
from statistics import median
from typing import NamedTuple

from door_impact_common.arrays import Array

from motion_execution.settings import ExecutionSettings

_BEFORE = 8  # number of readings whose median is expected of the next ones
_IN_CONTACT = 2  # number of the newest readings, which may be in the contact
_RISE = 0.2  # share of the threshold that the first reading in the contact must reach
_TOGETHER = 0.022  # longest time between two readings: three of 200 Hz may be lost between them [s]


class Sensor(enum.Enum):
    """What showed a contact."""

    IMU = "imu"
    FEET = "feet"
    DOOR = "door"


class Contact(NamedTuple):
    """A contact that was detected.

    Attributes:
        begin: Begin of the contact [s].
        shown: Stamp of the message that showed it [s].
        sensor: The sensor of this message.
    """

    begin: float
    shown: float
    sensor: Sensor


class ContactDetector:
    """Decides from each message of a sensor whether it shows a contact.

    The accelerometer shows one when two readings in a row exceed the median of those before them,
    in the direction away from the door: the newest by `contact_deceleration`, the one before by a
    fifth of that, since the contact may have begun near its end. The median contains gravity, bias
    and the acceleration of the run-up, which change little in 50 ms. A single reading never
    suffices, and it does not change the median, whatever it says.

    Args:
        settings: Thresholds.
        away: Horizontal unit vector away from the door in the IMU's frame, (3,).
    """

    def __init__(self, settings: ExecutionSettings, away: Array) -> None:
        self._settings = settings
        self._away = away
        # Stamps [s] and specific forces away from the door [m/s^2] of the last readings.
        self._readings: deque[tuple[float, float]] = deque(maxlen=_BEFORE + _IN_CONTACT)

    def on_imu(self, now: float, force: Array) -> Contact | None:
        """Handle a reading of the accelerometer.

        Args:
            now: Stamp of the reading [s].
            force: Specific force in the IMU's frame, (3,) [m/s^2].
        """
        readings = self._readings
        if readings and not 0.0 < now - readings[-1][0] <= _TOGETHER:
            readings.clear()
        readings.append((now, float(self._away @ force)))
        if len(readings) < _BEFORE + _IN_CONTACT:
            return None
        *quiet, (first, rise), (_, newest) = readings
        expected = median(value for _, value in quiet)
        rise, newest = rise - expected, newest - expected
        threshold = self._settings.contact_deceleration
        if not (rise >= _RISE * threshold and newest >= threshold):
            return None
        # A reading is a mean over its period: it shows which share of it the contact has lasted.
        share, (start, _) = min(1.0, rise / newest), quiet[-1]
        return Contact(first - share * (first - start), now, Sensor.IMU)

    def on_feet(self, now: float, force: float) -> Contact | None:
        """Handle the floor's force on both feet towards the door [N], with its stamp [s]."""
        if force >= self._settings.felt_force:
            return Contact(now - self._settings.force_delay, now, Sensor.FEET)
        return None

    def on_door(self, now: float, velocity: float) -> Contact | None:
        """Handle the door's angular velocity [rad/s], with its stamp [s]."""
        if velocity > self._settings.door_moves:
            return Contact(now, now, Sensor.DOOR)
        return None
