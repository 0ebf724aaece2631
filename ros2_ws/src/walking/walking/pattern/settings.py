"""Settings of the walking pattern."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from door_impact_common.errors import SettingError


@dataclass(frozen=True)
class WalkSettings:
    """Settings of the walking pattern.

    Attributes:
        double_support: Time at the beginning of each step in which both feet bear load [s].
        start: Time from rest to the first step, in which the waist sinks [s].
        end: Time from the last touchdown to rest, in which the waist rises [s].
        waist_height: Height of base_link above the floor while walking [m].
        lift: Height of the swing foot in the middle of a step [m].
        chest_swing: Turn of the upper body against the legs, per distance between the feet along
            the heading [rad/m].
        period: Time between two knots [s]; durations are whole multiples of it.
        horizon: Time that the preview control looks ahead [s].
        jerk_weight: Weight of the CoM's squared jerk against the squared ZMP error [s^6].
        required_margin: Smallest allowed distance of the ZMP from the edge of the soles [m].
        speed_share: Share of the joints' speed limits that may be used.
        torque_share: Share of the joints' torque limits that may be used.
        friction: Coefficient of friction between soles and floor that may be used.
    """

    double_support: float = 0.1
    start: float = 1.2
    end: float = 1.1
    waist_height: float = 0.62
    lift: float = 0.045
    chest_swing: float = 0.75
    period: float = 0.02
    horizon: float = 2.0
    jerk_weight: float = 1e-6
    required_margin: float = 0.02
    speed_share: float = 0.9
    torque_share: float = 0.9
    friction: float = 0.4

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            SettingError: A setting is not finite or not positive; `chest_swing` may be 0, and
                `required_margin` negative.
        """
        for name in (field.name for field in fields(self)):
            value, limit = getattr(self, name), "a positive number"
            fits = value > 0.0
            if name == "required_margin":
                limit, fits = "a finite number", True
            elif name == "chest_swing":
                limit, fits = "0 or more", value >= 0.0
            if not (math.isfinite(value) and fits):
                raise SettingError(name, value, limit)
