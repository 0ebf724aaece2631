"""The modified constant velocity cam curve MCV50 and the run-up that is made of its first half.

MCV50 is universal cam curve no. 27: the acceleration rises as a quarter sine in 1/16 of the time,
falls as a quarter cosine until 1/4, is zero until 3/4 (the "50" per cent of constant velocity)
and mirrors itself after that. Section II.C.4 of the paper uses the first half for the CoM, with
the impact at half time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

RISE_END = 1.0 / 16.0
FALL_END = 1.0 / 4.0
# Unit displacement at T = 1/2 by symmetry fixes the peak: Am (5/(32 pi) + 1/(8 pi^2)) = 1/2.
PEAK_ACCELERATION = 16.0 * np.pi**2 / (5.0 * np.pi + 4.0)
PEAK_VELOCITY = PEAK_ACCELERATION / (2.0 * np.pi)
PEAK_JERK = 8.0 * np.pi * PEAK_ACCELERATION


@dataclass(frozen=True)
class CamSample:
    """Displacement and its derivatives; arrays of the shape of the time that was asked for.

    Normalised for `mcv50`; in metres and seconds for `RunUp.at`.
    """

    s: Array
    v: Array
    a: Array
    jerk: Array


def mcv50(time: ArrayLike) -> CamSample:
    """Normalised MCV50: rest at (0, 0), rest at (1, 1).

    Args:
        time: Normalised time T, any shape. Before 0 and after 1 the follower dwells.

    Returns:
        s, v = ds/dT, a and jerk; the jerk at a break point is the one to its right.
    """
    t_all = np.asarray(time, dtype=float)
    mirrored = t_all > 0.5
    t = np.clip(np.where(mirrored, 1.0 - t_all, t_all), 0.0, 0.5)
    s, v, a, jerk = _first_half(t)
    dwell = (t_all < 0.0) | (t_all >= 1.0)
    return CamSample(
        s=np.where(mirrored, 1.0 - s, s),
        v=np.where(dwell, 0.0, v),
        a=np.where(dwell, 0.0, np.where(mirrored, -a, a)),
        jerk=np.where(dwell, 0.0, jerk),
    )


def _first_half(t: Array) -> tuple[Array, Array, Array, Array]:
    """Displacement, velocity, acceleration and jerk for 0 <= T <= 1/2."""
    am, vm = PEAK_ACCELERATION, PEAK_VELOCITY
    w1, w2 = 8.0 * np.pi, 8.0 * np.pi / 3.0
    rise, fall = t < RISE_END, (t >= RISE_END) & (t < FALL_END)
    u = t - RISE_END
    s1 = am / w1 * (RISE_END - 1.0 / w1)
    s = np.select(
        [rise, fall],
        [
            am / w1 * (t - np.sin(w1 * t) / w1),
            s1 + am / w1 * u + am / w2**2 * (1.0 - np.cos(w2 * u)),
        ],
        0.5 + vm * (t - 0.5),
    )
    v = np.select(
        [rise, fall],
        [am / w1 * (1.0 - np.cos(w1 * t)), am / w1 + am / w2 * np.sin(w2 * u)],
        vm,
    )
    a = np.select([rise, fall], [am * np.sin(w1 * t), am * np.cos(w2 * u)], 0.0)
    jerk = np.select([rise, fall], [am * w1 * np.cos(w1 * t), -am * w2 * np.sin(w2 * u)], 0.0)
    return s, v, a, jerk


@dataclass(frozen=True)
class RunUp:
    """Run-up from rest to a constant speed: the first half of MCV50, then straight on.

    Attributes:
        speed: Speed at the end of the first half, reached after half of its time [m/s].
        distance: Way of the first half, half the stroke of the whole curve [m].
    """

    speed: float
    distance: float

    def __post_init__(self) -> None:
        """Refuse what is no run-up."""
        for name, value in (("speed", self.speed), ("distance", self.distance)):
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} of a run-up must be finite and above 0, not {value}")

    @property
    def cam_period(self) -> float:
        """Time of the whole cam curve, of which the run-up uses half [s]."""
        return 2.0 * PEAK_VELOCITY * self.distance / self.speed

    @property
    def duration(self) -> float:
        """Time from rest to the nominal contact [s]."""
        return 0.5 * self.cam_period

    @property
    def peak_acceleration(self) -> float:
        """Largest acceleration, Am v^2 / (2 d Vm^2) = 2.464 v^2 / d [m/s^2]."""
        return PEAK_ACCELERATION * self.speed**2 / (2.0 * self.distance * PEAK_VELOCITY**2)

    def at(self, time: ArrayLike) -> CamSample:
        """Way, speed, acceleration and jerk at times from the start [s], any shape.

        After `duration` the speed stays constant, so that a late contact is hit at full speed.
        """
        t = np.asarray(time, dtype=float)
        period = self.cam_period
        stroke = 2.0 * self.distance
        cam = mcv50(np.minimum(t / period, 0.5))
        late = t > self.duration
        return CamSample(
            s=np.where(late, self.distance + self.speed * (t - self.duration), stroke * cam.s),
            v=stroke / period * cam.v,
            a=np.where(late, 0.0, stroke / period**2 * cam.a),
            jerk=np.where(late, 0.0, stroke / period**3 * cam.jerk),
        )
