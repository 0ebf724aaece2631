"""Limits of the robot's footsteps: the field `footsteps` of robot.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hrp2_description.errors import RobotConfigError


@dataclass(frozen=True)
class StepLimits:
    """How far one foot may be placed from the other, in the axes of the foot that stands.

    Distances are between the origins of the soles' frames.

    Attributes:
        ahead: Largest distance ahead of the standing foot [m].
        back: Largest distance behind the standing foot [m].
        width: Distance of the feet beside each other when the robot stands [m].
        narrowest: Smallest distance of the feet along the standing foot's y axis [m].
        widest: Largest distance of the feet along the standing foot's y axis [m].
        turn: Largest angle between the feet [rad].
        clearance: Smallest distance between the rectangles of the soles [m].
    """

    ahead: float
    back: float
    width: float
    narrowest: float
    widest: float
    turn: float
    clearance: float


def read_step_limits(data: Mapping[str, Any]) -> StepLimits:
    """Read the limits; `turn` is `turn_deg` [deg] in the file.

    Raises:
        RobotConfigError: A limit is missing, unknown or not positive, or the nominal width is not
            between the narrowest and the widest.
    """
    values = {name: float(value) for name, value in data.items() if name != "turn_deg"}
    values["turn"] = float(np.deg2rad(data["turn_deg"]))
    names = {field.name for field in fields(StepLimits)}
    if set(values) != names:
        raise RobotConfigError(
            "footsteps", value=sorted(data), limit=sorted(names - {"turn"} | {"turn_deg"}))
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0.0):
            raise RobotConfigError(f"{name} of footsteps", value=value, limit="a positive number")
    limits = StepLimits(**values)
    if not limits.narrowest <= limits.width <= limits.widest:
        raise RobotConfigError(
            "width of footsteps", value=limits.width,
            limit=f"from narrowest to widest, {limits.narrowest:g} to {limits.widest:g}")
    return limits
