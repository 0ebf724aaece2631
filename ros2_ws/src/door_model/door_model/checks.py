"""Checks of single numbers."""

import math

from door_model.errors import DoorParameterError


def require_finite(name: str, value: float) -> None:
    """Raise DoorParameterError unless the value is a finite number."""
    if not math.isfinite(value):
        raise DoorParameterError(name, value, "a finite number")


def require_positive(name: str, value: float) -> None:
    """Raise DoorParameterError unless the value is finite and above 0."""
    if not (math.isfinite(value) and value > 0.0):
        raise DoorParameterError(name, value, "a positive finite number")


def require_not_negative(name: str, value: float) -> None:
    """Raise DoorParameterError unless the value is finite and 0 or above."""
    if not (math.isfinite(value) and value >= 0.0):
        raise DoorParameterError(name, value, "a finite number of 0 or above")
