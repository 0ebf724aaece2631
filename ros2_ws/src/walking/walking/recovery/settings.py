"""Settings of the recovery after a push."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from door_impact_common.errors import SettingError


@dataclass(frozen=True)
class RecoverySettings:
    """Settings of the recovery after a push.

    Attributes:
        trigger: Error of the capture point from which a step is changed [m].
        again: Change of the predicted landing from which a changed step is changed anew [m].
        latency: Time from the measurement to the beginning of the new plan [s].
        shortest: Shortest time from the beginning of a new plan to the touchdown [s].
        longest: Longest time by which a touchdown is delayed [s].
        fastest_foot: Largest speed of the swing foot over the floor [m/s].
        blend: Time in which the reference of the CoM joins that of the measured one [s].
        inset: Distance from the edge of a sole that the ZMP of a plan keeps [m].
        reserve: Wanted distance of the capture point from the edge of the soles at touchdown [m].
        end: Time from touchdown to rest [s].
    """

    trigger: float = 0.035
    again: float = 0.025
    latency: float = 0.015
    shortest: float = 0.16
    longest: float = 0.4
    fastest_foot: float = 1.6
    blend: float = 0.5
    inset: float = 0.01
    ramp: float = 0.3
    pause: float = 0.02
    late: float = 0.3
    least: float = 0.45
    filter: float = 0.015
    hopeless: float = 0.045
    double: float = 0.08
    swing: float = 0.24
    hold: float = 0.03
    outward: float = 0.9
    frozen: float = 0.08
    reserve: float = 0.08
    end: float = 1.4

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            SettingError: A setting is not finite or not positive.
        """
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(name, value, "a positive number")
