"""What the door does after the hit, sections II.B and II.C.2, and how sure that is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_model.door import Door
from door_model.dynamics import Swing, initial_velocity, simulate
from door_model.errors import DoorModelError, DoorParameterError
from door_model.prediction import predict_peak
from numpy.typing import NDArray

from .errors import AngleUnreachable, InvalidRequest
from .plan_types import KnownDoor

Array = NDArray[np.float64]

_AFTER_PEAK = 4.0  # the swing is followed so long [s]
_PERIOD = 0.02  # between its samples [s]


@dataclass(frozen=True)
class DoorPrediction:
    """Motion of the door after the hit.

    Attributes:
        omega: Angular velocity after the hit, w' [rad/s].
        peak_time: From the hit to the largest angle [s].
        peak_time_std: Standard deviation for an exact w' [s].
        peak_angle: [rad].
        peak_angle_std: Standard deviation for an exact w' [rad].
        swing: Free motion from the hit on, until some time after the peak.
    """

    omega: float
    peak_time: float
    peak_time_std: float
    peak_angle: float
    peak_angle_std: float
    swing: Swing

    def angle_at(self, time: Array) -> Array:
        """Angle at times after the hit, (N,) [rad]; before and after the swing as at its ends."""
        return np.asarray(np.interp(time, self.swing.t, self.swing.theta))


def predict(known: KnownDoor, angle: float, initial_angle: float) -> DoorPrediction:
    """The angular velocity that opens the door to an angle, and how sure the angle is.

    The standard deviations carry the covariance of the identified parameters through eq. (1), with
    w' as planned.

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
        covariance = np.zeros((0, 0)) if known.covariance is None else known.covariance
        summit = predict_peak(door, known.parameters, covariance, omega, initial_angle)
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
    swing = simulate(
        door, initial_angle, omega, summit.time + _AFTER_PEAK, period=_PERIOD, stop=True)
    return DoorPrediction(
        omega, summit.time, summit.time_std, summit.angle, summit.angle_std, swing)


def _opening_limit(door: Door) -> float:
    try:
        return float(door.closer.opening_limit())
    except DoorModelError:
        return 0.0
