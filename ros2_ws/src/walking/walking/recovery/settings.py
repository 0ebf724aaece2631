"""Settings of the recovery after a push."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from door_impact_common.errors import SettingError


@dataclass(frozen=True)
class RecoverySettings:
    """Settings of the recovery after a push.

    Attributes:
        trigger: Error of the capture point from which a walk is changed [m]. In undisturbed walks
            it stays below 12 mm.
        again: Error from which a changed walk is changed anew [m].
        pause: Shortest time between two changes [s].
        frozen: Time before a touchdown in which its step is not changed any more [s].
        filter: Time constant with which the measured capture point corrects the pendulum's [s].
        latency: Time from the measurement to the beginning of the new plan [s].
        shortest: Shortest time to a touchdown that is brought forward [s].
        longest: Longest time by which a touchdown is delayed [s].
        fastest_foot: Largest speed of the swing foot over the floor [m/s].
        inset: Distance from the edge of a sole that the ZMP of a plan keeps [m].
        reserve: Wanted distance of the capture point from the edge of the soles at touchdown [m].
        spare: On both feet, distance from the edge of the soles below which a step is made [m].
        enough: On both feet, the least distance that such a step must lead to [m].
        double: Time in which a foot is unloaded before such a step [s].
        swing: Shortest duration of its single support [s].
        blend: Time in which the reference of the CoM joins the measured one [s].
        blend_outward: The same if the robot falls to the side of its standing foot [s].
        blend_least: The shortest such time that is left to a plan that was changed anew [s].
        settle: Time after touchdown in which the ZMP moves between the soles [s].
        end: Time from touchdown to rest [s].
        lift: Height of the swing foot in the middle of a step [m].
        speed_share: Share of the joints' speed limits that may be used.
    """

    trigger: float = 0.035
    again: float = 0.025
    pause: float = 0.02
    frozen: float = 0.12
    filter: float = 0.015
    latency: float = 0.015
    shortest: float = 0.16
    longest: float = 0.4
    fastest_foot: float = 1.2
    inset: float = 0.01
    reserve: float = 0.08
    spare: float = 0.03
    enough: float = 0.045
    double: float = 0.08
    swing: float = 0.24
    blend: float = 0.5
    blend_outward: float = 0.9
    blend_least: float = 0.45
    settle: float = 0.3
    end: float = 1.4
    lift: float = 0.045
    speed_share: float = 1.0

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            SettingError: A setting is not finite or not positive.
        """
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(name, value, "a positive number")
