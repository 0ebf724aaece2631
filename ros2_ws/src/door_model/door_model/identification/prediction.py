"""Prediction of how far a free door opens, and of the uncertainty of this angle."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from door_model.door.door import Door
from door_model.identification.parameters import RATIO_OF, is_angle
from door_model.motion.dynamics import peak
from door_model.motion.free_motion import UNKNOWNS, follow

NORMAL_95 = 1.959964  # half width of the 95 % interval of a normal distribution / std


@dataclass(frozen=True)
class PredictedPeak:
    """The predicted peak of a free door whose start is known exactly.

    Attributes:
        time: Time from the start to the peak [s].
        time_std: Standard deviation of the time, caused by the door's parameters [s].
        angle: Opening angle at the peak [rad].
        angle_std: Standard deviation of the angle [rad].
    """

    time: float
    time_std: float
    angle: float
    angle_std: float

    def interval(self) -> tuple[float, float]:
        """Return the angles between which the peak lies with 95 % probability [rad]."""
        away = NORMAL_95 * self.angle_std
        return self.angle - away, self.angle + away


def predict_peak(
    door: Door, names: Sequence[str], covariance: NDArray[np.float64], omega0: float,
    theta0: float = 0.0
) -> PredictedPeak:
    """Predict the peak of a free motion and its uncertainty from the parameters' covariance.

    The derivatives of eq. (1) are exact. A common factor of all parameters has no effect on the
    motion, so most of the scale's uncertainty cancels.

    Args:
        door: The door.
        names: Names of the uncertain parameters (P,), as in `Identification.names`.
        covariance: Covariance of these parameters (P, P), in SI units.
        omega0: Angular velocity at the start [rad/s], positive.
        theta0: Angle at the start [rad].

    Raises:
        DoorModelError: The door does not turn round, as in `motion.dynamics.peak`.
    """
    top = peak(door, theta0, omega0)
    motion = follow(
        door.closer.numbers(), door.ratios(), theta0, omega0, until=2.0 * top.time, to_peak=True,
        exact=True)
    slopes = np.array([
        _by_parameters(door, names, row[:, 0]) for row in (motion.d_end_time, motion.d_end_angle)])
    variance = np.einsum("ij,jk,ik->i", slopes, np.asarray(covariance, dtype=float), slopes)
    time_std, angle_std = (float(std) for std in np.sqrt(np.maximum(variance, 0.0)))
    return PredictedPeak(top.time, time_std, top.angle, angle_std)


def _by_parameters(
    door: Door, names: Sequence[str], by_unknowns: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Convert derivatives by ratios to derivatives by parameters (P,).

    A ratio that follows another one, such as the viscosity of closing if it has no value of its
    own, needs no treatment: it does not act before the peak.
    """
    ratios = door.ratios()
    scaled = [name for name in RATIO_OF.values() if not is_angle(name)]
    place = {name: UNKNOWNS.index(name) for name in RATIO_OF.values()}
    by_inertia = -sum(float(getattr(ratios, name)) * by_unknowns[place[name]] for name in scaled)
    answer = []
    for name in names:
        if name == "i_a":
            answer.append(by_inertia / door.i_a)
        else:
            slope = by_unknowns[place[RATIO_OF[name]]]
            answer.append(slope if is_angle(name) else slope / door.i_a)
    return np.array(answer)
