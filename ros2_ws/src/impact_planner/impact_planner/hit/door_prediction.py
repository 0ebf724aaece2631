"""Motion of the door after the hit, sections II.B and II.C.2, with its uncertainty."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_model.errors import DoorModelError, DoorParameterError
from door_model.identification.prediction import predict_peak
from door_model.motion.dynamics import follow_free, initial_velocity
from door_model.motion.free_motion import FreeMotion

from impact_planner.errors import AngleUnreachable, InvalidRequest
from impact_planner.task.known_door import KnownDoor

_FOLLOWED = 12.0  # longest simulated swing, which ends earlier where the door falls shut [s]


@dataclass(frozen=True)
class DoorPrediction:
    """Motion of the door after the hit.

    Attributes:
        omega: Angular velocity w' after the hit [rad/s].
        peak_time: Time from the hit to the largest angle [s].
        peak_time_std: Standard deviation of the peak's time for an exact w' [s].
        peak_angle: Largest opening angle [rad].
        peak_angle_std: Standard deviation of the largest angle for an exact w' [rad].
        swing: Free motion from the hit until some time after the peak.
    """

    omega: float
    peak_time: float
    peak_time_std: float
    peak_angle: float
    peak_angle_std: float
    swing: FreeMotion

    def angle_at(self, time: Array) -> Array:
        """Compute the opening angle at times (N,) [s] after the hit, (N,) [rad].

        Before and after the swing, the angle is that of the swing's start and end.
        """
        return self.swing.at(np.maximum(time, 0.0))[0][:, 0]


def predict(known: KnownDoor, angle: float, initial_angle: float) -> DoorPrediction:
    """Find the angular velocity w' that opens the door to an angle, by eq. (1).

    The standard deviations follow from the covariance of the identified parameters by eq. (1)
    with the planned w'.

    Args:
        angle: Desired opening angle [rad].
        initial_angle: Opening angle at the hit [rad].

    Raises:
        AngleUnreachable: The closer's linkage does not assemble at the angle, or the door does
            not come to rest there. Value and limit are angles [rad].
        InvalidRequest: The angles are not finite, or the desired angle is not the larger one.
    """
    door = known.door
    try:
        omega = initial_velocity(door, angle, initial_angle)
        swing = follow_free(door, initial_angle, omega, until=_FOLLOWED)
        time_std, angle_std = 0.0, 0.0
        if known.covariance is not None:
            summit = predict_peak(door, known.parameters, known.covariance, omega, initial_angle)
            time_std, angle_std = summit.time_std, summit.angle_std
    except DoorParameterError as error:
        raise InvalidRequest(
            str(error), quantity="desired_opening_angle [rad]", value=angle, limit=str(error.limit)
        ) from error
    except DoorModelError as error:
        limit = 0.0  # where the linkage allows no angle at all
        with suppress(DoorModelError):
            limit = float(door.closer.opening_limit())
        raise AngleUnreachable(
            f"the door cannot open to {math.degrees(angle):.1f} deg: {error}; its linkage opens to "
            f"{math.degrees(limit):.1f} deg, so request a smaller angle",
            quantity="desired_opening_angle [rad]",
            value=angle,
            limit=limit,
        ) from error
    return DoorPrediction(
        omega, float(swing.peak_time[0]), time_std, float(swing.peak_angle[0]), angle_std, swing)
