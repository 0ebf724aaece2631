"""Checks of single numbers and of arrays of numbers."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from door_model.errors import DoorParameterError

_ROUNDING = 1e-6  # deviation of a covariance that is taken for rounding, in standard deviations
_SMALLEST = float(np.finfo(float).tiny / np.finfo(float).eps)  # variance with all of its digits


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


def require_within(
    name: str, value: float, low: float, high: float, unit: str, *, least: bool = False
) -> None:
    """Raise DoorParameterError unless a value is in a range.

    Args:
        name: Name of the value for the error.
        value: Value.
        low: Lower end of the range, which belongs to it with `least`.
        high: Upper end, which belongs to the range.
        unit: Unit for the error, and in brackets one that the value may have instead.
        least: Whether the value may be `low`.
    """
    if not (low <= value if least else low < value) or not value <= high:
        raise DoorParameterError(
            name, value, f"{'from' if least else 'above'} {low:g} up to {high:g} {unit}")


def place(shape: tuple[int, ...], number: int) -> str:
    """Return words that name an element of an array by its flat index; empty for a scalar."""
    if not shape:
        return ""
    index = ", ".join(str(along) for along in np.unravel_index(number, shape))
    return f" (element [{index}])"


def require_each(name: str, values: NDArray[Any], good: NDArray[np.bool_], limit: str) -> None:
    """Raise DoorParameterError for the first element that is not good.

    Args:
        name: Name of the values for the error.
        values: Values of any shape.
        good: Which values are good, in the same shape.
        limit: What the values must be, in words.
    """
    wrong = np.flatnonzero(~good)
    if wrong.size:
        first = int(wrong[0])
        raise DoorParameterError(
            name + place(values.shape, first), float(values.flat[first]), limit)


def require_covariance(name: str, covariance: NDArray[np.float64]) -> None:
    """Raise DoorParameterError unless a matrix can be the covariance of random numbers.

    Such a matrix is finite, symmetric and positive semidefinite. Its variances may be 0, because
    a parameter may be known exactly.

    Args:
        name: Name of the matrix for the error.
        covariance: The matrix (P, P).
    """
    require_each(name, covariance, np.isfinite(covariance), "finite")
    variance = np.diag(covariance)
    require_each(f"the diagonal of {name}", variance, variance >= 0.0, "0 or above")
    # A variance next to the smallest number has lost digits: no correlation can be told from it.
    size = np.sqrt(np.where(variance > _SMALLEST, variance, 1.0))
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        correlation = covariance / size / size[:, None]
    possible = np.abs(correlation) <= 1.0 + _ROUNDING
    require_each(name, covariance, possible, "at most the product of two standard deviations")
    equal = np.abs(correlation - correlation.T) <= _ROUNDING
    require_each(name, covariance, equal, "symmetric")
    lowest = float(np.linalg.eigvalsh(correlation)[0])
    if lowest < -_ROUNDING:
        raise DoorParameterError(
            f"the smallest eigenvalue of {name}, scaled to variances of 1,", lowest, "0 or above")
