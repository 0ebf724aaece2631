"""What the door does after the hit, sections II.B and II.C.2, and how sure that is."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_model.door import Door
from door_model.dynamics import initial_velocity, peak
from door_model.errors import DoorModelError, DoorParameterError

from .errors import AngleUnreachable, InvalidRequest
from .plan_types import KnownDoor

_PARAMETERS = ("i_a", "c_c", "k_c", "tau_c0_prime")


@dataclass(frozen=True)
class DoorPrediction:
    """Motion of the door after the hit.

    Attributes:
        omega: Angular velocity after the hit, w' [rad/s].
        peak_time: From the hit to the largest angle [s].
        peak_time_std: Standard deviation for an exact w' [s].
        peak_angle: [rad].
        peak_angle_std: Standard deviation for an exact w' [rad].
    """

    omega: float
    peak_time: float
    peak_time_std: float
    peak_angle: float
    peak_angle_std: float


def predict(known: KnownDoor, angle: float, initial_angle: float) -> DoorPrediction:
    """The angular velocity that opens the door to an angle, and how sure the angle is.

    The standard deviations carry the covariance of the identified parameters through eq. (1) by
    central differences, with w' as planned.

    Args:
        known: The door.
        angle: Desired opening angle [rad].
        initial_angle: At the hit [rad].

    Raises:
        AngleUnreachable: The closer's linkage does not assemble there, or the door does not
            come to rest there; value and limit are angles [rad].
        InvalidRequest: The angles are no numbers or in the wrong order.
    """
    door = known.door
    try:
        omega = initial_velocity(door, angle, initial_angle)
        summit = peak(door, initial_angle, omega)
    except DoorParameterError as error:
        raise InvalidRequest(
            str(error), quantity="desired_opening_angle [rad]", value=angle, limit=str(error.limit)
        ) from error
    except DoorModelError as error:
        limit = _opening_limit(door)
        raise AngleUnreachable(
            f"{math.degrees(angle):.1f} deg: {error}; the linkage opens to "
            f"{math.degrees(limit):.1f} deg",
            quantity="desired_opening_angle [rad]",
            value=angle,
            limit=limit,
        ) from error
    time_std, angle_std = _spread(known, initial_angle, omega)
    return DoorPrediction(omega, summit.time, time_std, summit.angle, angle_std)


def _opening_limit(door: Door) -> float:
    try:
        return float(door.closer.opening_limit())
    except DoorModelError:
        return 0.0


def _spread(known: KnownDoor, initial_angle: float, omega: float) -> tuple[float, float]:
    if known.covariance is None:
        return 0.0, 0.0
    covariance = np.asarray(known.covariance, dtype=float)
    slopes = np.zeros((2, len(_PARAMETERS)))
    for i, name in enumerate(_PARAMETERS):
        value = float(getattr(known.door, name))
        step = 1e-3 * abs(value)
        if covariance[i, i] <= 0.0 or step == 0.0:
            continue
        try:
            high = peak(_changed(known.door, name, value + step), initial_angle, omega)
            low = peak(_changed(known.door, name, value - step), initial_angle, omega)
        except DoorModelError:
            return math.nan, math.nan
        slopes[0, i] = (high.time - low.time) / (2.0 * step)
        slopes[1, i] = (high.angle - low.angle) / (2.0 * step)
    variances = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
    time_std, angle_std = np.sqrt(np.maximum(variances, 0.0))
    return float(time_std), float(angle_std)


def _changed(door: Door, name: str, value: float) -> Door:
    changes: dict[str, Any] = {name: value}
    return dataclasses.replace(door, **changes)
