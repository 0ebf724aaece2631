"""The admittance of a hand: a virtual mass, damper and spring that a measured force moves.

    M x'' + D x' + K x = s F

x is the displacement of the hand from its commanded place and F the force of the surroundings on
it, both in the axes of the world. s fades the force in.

The measured force is the mean over a tick, and the displacement that answers it is reached at the
end of the next one; with the servo this is a delay of some two ticks. Against a wall, an arm of the
stiffness k through n ticks of delay is stable if D is at least (M 2 to 20 kg, K 300 N/m;
eigenvalues of the sampled loop):

    k [N/m]     n = 1     n = 2     n = 3
      5 000      30        50        80  N s/m
     10 000      50       100       150
     20 000     100       190       290

HRP-2's stretched arm gives by 0.2 mm/N at rest (5 000 N/m) and is stiffer in a tremor.
"""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.documents import STRICT, number
from pydantic.dataclasses import dataclass

from hrp2_sim_bridge.settings import TICK

FADE = 0.2  # time in which a change of the impedance comes into effect [s]
FARTHEST = 0.12  # largest displacement [m]
FASTEST = 0.5  # largest speed of the displacement [m/s]
RETURN_SPEED = 0.1  # largest speed at which a hand that becomes stiff returns [m/s]
_RETURN = np.array([0.0, 2000.0, 200.0, 5.0])  # its share of the force, stiffness, damping, mass
_BRAKING = 0.9  # share of a higher speed that it keeps in a tick
_BACK = 1e-5  # displacement at which it has returned [m]


@dataclass(frozen=True, config=STRICT)
class HandImpedance:
    """Virtual mass, damper and spring between the commanded and the actual place of a hand.

    A hand whose commanded place lies F / stiffness behind a surface presses on it with F.
    """

    stiffness: float = number(200.0, 50.0, 2000.0, "stiffness of the spring [N/m]")
    damping: float = number(150.0, 100.0, 5000.0, "damping [N s/m]")
    mass: float = number(5.0, 2.0, 50.0, "mass [kg]")


class Admittance:
    """The displacement of one hand, advanced tick by tick; at first the hand is stiff.

    The integration is implicit, so that a hand in the air is stable with every impedance.

    Attributes:
        place: Displacement, (3,) [m].
        speed: Its speed, (3,) [m/s].
        impedance: Impedance that was asked for last; None is a stiff hand.
    """

    def __init__(self) -> None:
        self.place, self.speed = np.zeros(3), np.zeros(3)
        self.impedance: HandImpedance | None = None
        self._values = _RETURN  # those in effect, in the same order
        self._fading = 0  # ticks until a change is in effect

    @property
    def active(self) -> bool:
        """Whether the hand is compliant or on its way back to its commanded place."""
        return self.impedance is not None or bool(self.place.any())

    def change(self, impedance: HandImpedance | None) -> None:
        """Change the impedance over `FADE`; neither place nor speed jumps.

        A hand that becomes stiff returns to its commanded place.
        """
        if not self.active and impedance is not None:
            self._values = _values_of(impedance) * (0.0, 1.0, 1.0, 1.0)
        self.impedance, self._fading = impedance, round(FADE / TICK)

    def update(self, force: Array) -> None:
        """Advance by a tick under a force (3,) [N]; one without numbers stops the displacement."""
        stiff = self.impedance is None
        goal = _RETURN if self.impedance is None else _values_of(self.impedance)
        self._values = self._values + (goal - self._values) / max(self._fading, 1)
        self._fading = max(self._fading - 1, 0)
        if not np.isfinite(force).all():
            force = np.zeros(3)
            if not stiff:
                self.speed = force
                return
        share, stiffness, damping, mass = self._values.tolist()
        push = share * force - stiffness * self.place
        speed = (mass * self.speed + TICK * push) / (mass + TICK * (damping + TICK * stiffness))
        most = max(RETURN_SPEED, _BRAKING * _length(self.speed)) if stiff else FASTEST
        self.speed = shortened(speed, most)
        self.place = self.place + TICK * self.speed
        self.keep_to(shortened(self.place, FARTHEST))
        if stiff and self._fading == 0 and _length(self.place) < _BACK:
            self.place, self.speed = np.zeros(3), np.zeros(3)

    def keep_to(self, place: Array) -> None:
        """Replace the displacement by one (3,) [m] that can be reached; speed beyond it ends."""
        beyond = self.place - place
        length = _length(beyond)
        if length > 0.0:
            away = beyond / length
            self.speed = self.speed - max(float(self.speed.dot(away)), 0.0) * away
        self.place = place


def _values_of(impedance: HandImpedance) -> Array:
    return np.array([1.0, impedance.stiffness, impedance.damping, impedance.mass])


def _length(vector: Array) -> float:
    return math.hypot(*vector.tolist())


def shortened(vector: Array, most: float) -> Array:
    """Return a vector in the same direction whose length is at most `most`."""
    length = _length(vector)
    return vector * (most / length) if length > most else vector
