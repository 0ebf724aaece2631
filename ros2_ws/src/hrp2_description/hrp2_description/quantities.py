"""Lengths and angles of a robot.yaml; those in another unit are refused."""

from __future__ import annotations

import math
from typing import Annotated, TypeVar

import numpy as np
from door_impact_common.documents import Positive
from pydantic import AfterValidator

T = TypeVar("T")
LARGEST = 3.0  # largest length in a description of a humanoid [m]


def in_metres(value: T) -> T:
    """Return a length or several; the error of a larger one than a humanoid has asks for mm."""
    if np.max(np.abs(np.asarray(value))) > LARGEST:
        raise ValueError(f"at most {LARGEST:g} m (mm?)")
    return value


def in_degrees(value: float) -> float:
    """Return an angle; the error of one that is too small for degrees asks for radians."""
    if abs(value) <= math.pi / 2.0:
        raise ValueError("above 1.6 deg (radians?)")
    return value


Length = Annotated[Positive, AfterValidator(in_metres)]
