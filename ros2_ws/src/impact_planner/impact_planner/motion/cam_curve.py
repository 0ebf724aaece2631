"""The modified constant velocity cam curve MCV50 of Fig. 6, and the run-up along its first half.

MCV50 is universal cam curve no. 27. Its acceleration rises as a quarter sine during the first 1/16
of the time, falls as a quarter cosine until 1/4 and is zero until 3/4, which is the "50" per cent
of constant velocity. The last quarter mirrors the first. Section II.C.4 of the paper moves the CoM
along the first half, with the impact at half time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

RISE_END = 1.0 / 16.0  # normalised time at which the acceleration has its peak
FALL_END = 1.0 / 4.0  # normalised time at which the velocity becomes constant
# By symmetry the displacement is 1/2 at T = 1/2, which fixes the peak acceleration Am:
# Am (5/(32 pi) + 1/(8 pi^2)) = 1/2.
PEAK_ACCELERATION = 16.0 * np.pi**2 / (5.0 * np.pi + 4.0)
PEAK_VELOCITY = PEAK_ACCELERATION / (2.0 * np.pi)
PEAK_JERK = 8.0 * np.pi * PEAK_ACCELERATION


@dataclass(frozen=True)
class CamSample:
    """Displacement and its derivatives by time, in arrays of the shape of the requested times.

    They are normalised for `mcv50`, and in metres and seconds for the `at` of a run-up.

    Attributes:
        s: Displacement.
        v: Velocity.
        a: Acceleration.
        jerk: Derivative of the acceleration.
    """

    s: Array
    v: Array
    a: Array
    jerk: Array


def mcv50(time: ArrayLike) -> CamSample:
    """Evaluate the normalised MCV50 from rest at (0, 0) to rest at (1, 1), Fig. 6.

    Args:
        time: Normalised times T of any shape. Before 0 and after 1 the follower rests.

    Returns:
        s, v = ds/dT, a and jerk. The jerk at a break point is its limit from the right.
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
    """Compute displacement, velocity, acceleration and jerk for 0 <= T <= 1/2."""
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
class CamRunUp:
    """Run-up from rest to a constant speed: the first half of MCV50, then at constant speed.

    Attributes:
        speed: Speed at the contact; the curve reaches it at a quarter of its period [m/s].
        distance: Distance of the first half, which is half the stroke of the whole curve [m].
    """

    speed: float
    distance: float

    @property
    def cam_period(self) -> float:
        """Duration of the whole cam curve, of which the run-up uses half [s]."""
        return 2.0 * PEAK_VELOCITY * self.distance / self.speed

    @property
    def duration(self) -> float:
        """Time from rest to the nominal contact [s]."""
        return 0.5 * self.cam_period

    def at(self, time: ArrayLike) -> CamSample:
        """Compute displacement and its derivatives at times from the start [s], of any shape.

        After `duration` the speed stays constant, so that a late contact is met at full speed.
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
