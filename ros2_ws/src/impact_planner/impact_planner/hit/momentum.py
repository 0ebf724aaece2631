"""Momentum transfer from the robot to the door, section II.C.3 and eqs. (2) to (5).

Eq. (4) is misprinted in the paper: with (2) and (3) it reads
``v_rB = I_A w' / (m_re l_B) + v'_rB`` with ``m_re = I_rob m / (I_rob + a_r^2 m)``.
It leaves v'_rB free; the coefficient of restitution e closes it:
``w' l_B - v'_rB = e v_rB``. Speeds are positive towards the door.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ImpactSpeeds:
    """Speeds around the hit.

    Attributes:
        v_rb: Speed of point B of the robot before the hit [m/s].
        v_rb_post: Speed of point B after the hit, v'_rB [m/s].
        impulse: Impulse that the robot gives to the door [N s].
    """

    v_rb: float
    v_rb_post: float
    impulse: float

    @property
    def ratio(self) -> float:
        """Speed of B after the hit over that before it."""
        return self.v_rb_post / self.v_rb


def effective_mass_planar(mass: float, i_rob: float, a_r: float) -> float:
    """Effective mass at B of a free rigid body in the frontal plane, eq. (3).

    Args:
        mass: Mass of the robot [kg].
        i_rob: Moment of inertia about the x axis through the CoM [kg m^2].
        a_r: Height of B above the CoM [m].

    Returns:
        m_re [kg].
    """
    _require_positive(mass=mass, i_rob=i_rob)
    return i_rob * mass / (i_rob + a_r**2 * mass)


def percussion_height(mass: float, i_rob: float, a_r: float) -> float:
    """Height of the CoM above the floor that puts the center of percussion there, eq. (5) [m]."""
    _require_positive(mass=mass, i_rob=i_rob, a_r=a_r)
    return i_rob / (mass * a_r)


def percussion_offset(mass: float, i_rob: float, b_r: float) -> float:
    """Height of B above the CoM for a CoM height b_r: eq. (5) solved for a_r [m]."""
    _require_positive(mass=mass, i_rob=i_rob, b_r=b_r)
    return i_rob / (mass * b_r)


def foot_impulse_planar(mass: float, i_rob: float, a_r: float, b_r: float) -> float:
    """Impulse of the floor at C along the door's normal for 1 N s given to the door.

    A rigid robot that turns about C, a height b_r under its CoM: zero where eq. (5) holds;
    positive where the floor pushes it on, towards the door.
    """
    _require_positive(mass=mass, i_rob=i_rob, b_r=b_r)
    return (i_rob - mass * a_r * b_r) / (i_rob + mass * b_r**2)


def speeds_for(
    omega: float,
    *,
    i_a: float,
    l_b: float,
    effective_mass: float,
    restitution: float,
    braking: float = 0.0,
) -> ImpactSpeeds:
    """Speeds of B that give the door an angular velocity: eqs. (2), (4 corrected) and restitution.

    Args:
        omega: Angular velocity w' of the door after the hit [rad/s].
        i_a: Moment of inertia of the door about its hinge [kg m^2].
        l_b: Distance of B from the hinge [m].
        effective_mass: m_re of the robot at B [kg].
        restitution: Coefficient of restitution e, 0 (plastic) to 1.
        braking: Angular impulse of the closer that the hit must make up for besides, see
            `closer_braking` [N m s].

    Returns:
        The speeds before and after the hit and the impulse.

    Raises:
        ValueError: Something is not positive, or e is outside [0, 1].
    """
    _require_positive(omega=omega, i_a=i_a, l_b=l_b, effective_mass=effective_mass)
    _require_restitution(restitution)
    impulse = (i_a * omega + braking) / l_b
    v_rb = (impulse / effective_mass + omega * l_b) / (1.0 + restitution)
    return ImpactSpeeds(v_rb=v_rb, v_rb_post=omega * l_b - restitution * v_rb, impulse=impulse)


def closer_braking(torque: float, duration: float) -> float:
    """What the closer takes from a hit that lasts, beside one in an instant [N m s].

    Force that rises and falls alike acts in the mean at half of the contact; a hit in an instant
    there would find the closer still holding a door at rest.

    Args:
        torque: Of the closer, and of friction, where the door is hit [N m].
        duration: Of the contact [s].
    """
    return 0.5 * torque * duration


def omega_for(
    v_rb: float,
    *,
    i_a: float,
    l_b: float,
    effective_mass: float,
    restitution: float,
    braking: float = 0.0,
) -> float:
    """Angular velocity w' of the door after a hit at the speed v_rB: inverse of `speeds_for`."""
    _require_positive(v_rb=v_rb, i_a=i_a, l_b=l_b, effective_mass=effective_mass)
    _require_restitution(restitution)
    reach = l_b * effective_mass
    return ((1.0 + restitution) * v_rb - braking / reach) / (i_a / reach + l_b)


def _require_restitution(restitution: float) -> None:
    if not 0.0 <= restitution <= 1.0:
        raise ValueError(f"restitution must be between 0 and 1, not {restitution}")


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be finite and above 0, not {value}")
