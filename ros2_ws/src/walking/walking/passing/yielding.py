"""How far a yielding hand is from its commanded place while it presses on the leaf.

A driver whose hand yields displaces it by M x'' + D x' + K x = F, and bounds the displacement and
its speed. The hand stays where the leaf shall be if its commanded place lies x behind that, with F
the planned force. It takes D / K, about a second, until x has grown to F / K.
"""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array

from walking.passing.settings import PassageSettings

_STEP = 0.005  # step of the integration [s]


def yielded(time: Array, force: Array, settings: PassageSettings) -> Array:
    """Compute the displacement of a hand that begins at its commanded place, at rest.

    The integration is implicit, so that it is stable for every impedance.

    Args:
        time: Rising times, (N,) [s].
        force: Force of the leaf on the hand at these times, linear between them, (N,) [N].
        settings: The hand's impedance, and the bounds of its displacement.

    Returns:
        Displacements, (N,) [m].
    """
    if not settings.yields:
        return np.zeros(len(time))
    stiffness, damping, mass = settings.impedance
    count = max(2, 1 + int(np.ceil((time[-1] - time[0]) / _STEP)))
    fine = np.linspace(time[0], time[-1], count)
    step = float(fine[1] - fine[0])
    place, speed, found = 0.0, 0.0, np.zeros(count)
    for row, push in enumerate(np.interp(fine[1:], time, force).tolist(), start=1):
        speed = (mass * speed + step * (push - stiffness * place)) / (
            mass + step * (damping + step * stiffness))
        speed = min(max(speed, -settings.hand_fastest), settings.hand_fastest)
        place += step * speed
        if abs(place) > settings.hand_farthest:
            place = float(np.copysign(settings.hand_farthest, place))
            speed = 0.0
        found[row] = place
    return np.asarray(np.interp(time, fine, found))
