r"""The leaf's surface: the spring and damper that show two free masses a wanted restitution.

Two bodies of reduced mass `mu` that meet with a speed v press a spring and damper between
them which cannot pull. With a natural frequency `omega_0 = sqrt(k / mu)` and a damping
ratio `zeta = c / (2 sqrt(k mu))` the contact ends when the force becomes zero, which is
before the spring is relaxed. Duration and restitution have a closed form: T. Schwager and
T. Poeschel, Coefficient of restitution and linear-dashpot model revisited, Granular Matter 9,
2007. "Restitution" and "duration of contact" of a leaf are those of such free masses. They
describe the elbow's cover and the leaf alone; what the robot's arm gives comes on top.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.optimize import brentq

from door_model.checks import require_positive
from door_model.errors import DoorParameterError

ROBOT_MASS = 58.0  # mass of the free body that hits the leaf, about that of the robot [kg]
LEAST_LEVER = 0.1  # shortest distance of a hit from the hinge [m]
MOST_DAMPING = 8.0  # damping ratio of a plastic contact
_CRITICAL = 1e-6  # distance from critical damping below which the formulas lose digits


@dataclass(frozen=True)
class Surface:
    """Spring and damper between elbow and leaf, along the leaf's normal.

    Attributes:
        stiffness: Stiffness [N/m].
        damping: Damping [N s/m].
    """

    stiffness: float
    damping: float


def reduced_mass(first: float, second: float) -> float:
    """Return the reduced mass of two masses: it moves as their distance does [kg]."""
    return first * second / (first + second)


def mass_of_hit(i_a: float, lever: float) -> float:
    """Return the reduced mass for which the leaf's surface is designed [kg].

    Args:
        i_a: Moment of inertia of the leaf about its hinge [kg m^2].
        lever: Distance of the hit from the hinge [m]; a shorter one counts as `LEAST_LEVER`.
    """
    return reduced_mass(ROBOT_MASS, i_a / max(abs(lever), LEAST_LEVER) ** 2)


def surface(restitution: float, duration: float, mass: float) -> Surface:
    """Design a surface.

    Args:
        restitution: Coefficient of restitution that two free masses shall show, 0 to 1. Where even
            the damping ratio `MOST_DAMPING` shows more, that one is used.
        duration: Duration of their contact [s].
        mass: Their reduced mass [kg].

    Raises:
        DoorParameterError: The restitution is outside 0 to 1, or another number is not positive.
    """
    if not 0.0 <= restitution <= 1.0:
        raise DoorParameterError("restitution", restitution, "from 0 to 1")
    require_positive("duration", duration)
    require_positive("mass", mass)
    ratio = MOST_DAMPING
    if restitution > free_contact(MOST_DAMPING)[0]:
        ratio = float(brentq(
            lambda each: free_contact(each)[0] - restitution, 0.0, MOST_DAMPING, xtol=1e-9))
    frequency = free_contact(ratio)[1] / duration
    return Surface(mass * frequency**2, 2.0 * ratio * frequency * mass)


def free_contact(ratio: float) -> tuple[float, float]:
    """Return restitution, and duration times natural frequency, of a contact of free masses.

    Args:
        ratio: Damping ratio, 0 or more.
    """
    if abs(ratio - 1.0) < _CRITICAL:  # both sides approach these limits
        return math.exp(-2.0), 2.0
    if ratio < 1.0:
        damped = math.sqrt(1.0 - ratio**2)
        time = math.atan2(2.0 * ratio * damped, 2.0 * ratio**2 - 1.0) / damped
    else:
        spread = math.sqrt(ratio**2 - 1.0)
        time = math.log((ratio + spread) / (ratio - spread)) / spread
    return math.exp(-ratio * time), time
