"""Momentum transfer from the robot to the door: eqs. (2) to (5) of sections II.C.3 and II.C.4.

Speeds are positive towards the door. In the paper's letters:

- eq. (2): ``m_re v_rB l_B = m_re v'_rB l_B + I_A w'``, angular momentum about the hinge A;
- eq. (3): ``m_re = I_rob m / (I_rob + a_r^2 m)``, effective mass at B;
- eq. (4): ``v_rB = I_A w' / (m_re l_B) + v'_rB``, which is misprinted in the paper and follows
  from (2) and (3);
- eq. (5): ``b_r = I_rob / (m a_r)``, center of percussion on the floor.

Eq. (4) leaves v'_rB free. The coefficient of restitution e closes it:
``w' l_B - v'_rB = e v_rB``.
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
        impulse: Impulse m_re (v_rB - v'_rB) that the robot gives to the door, eq. (2) [N s].
    """

    v_rb: float
    v_rb_post: float
    impulse: float

    @property
    def ratio(self) -> float:
        """Speed of B after the hit divided by the speed before it."""
        return self.v_rb_post / self.v_rb


def effective_mass_planar(mass: float, i_rob: float, a_r: float) -> float:
    """Effective mass at B of a free rigid body in the frontal plane, eq. (3).

    Args:
        mass: Mass of the robot [kg].
        i_rob: Moment of inertia about the x axis through the CoM [kg m^2].
        a_r: Height of B above the CoM [m].

    Returns:
        The effective mass m_re [kg].

    Raises:
        ValueError: Mass or moment of inertia is not finite and positive.
    """
    _require_positive(mass=mass, i_rob=i_rob)
    return i_rob * mass / (i_rob + a_r**2 * mass)


def percussion_height(mass: float, i_rob: float, a_r: float) -> float:
    """Height b_r of the CoM that puts the center of percussion on the floor, eq. (5) [m].

    Args:
        mass: Mass of the robot [kg].
        i_rob: Moment of inertia about the x axis through the CoM [kg m^2].
        a_r: Height of B above the CoM [m].

    Raises:
        ValueError: An argument is not finite and positive.
    """
    _require_positive(mass=mass, i_rob=i_rob, a_r=a_r)
    return i_rob / (mass * a_r)


def percussion_offset(mass: float, i_rob: float, b_r: float) -> float:
    """Height a_r of B above the CoM for a given height b_r of the CoM: eq. (5) for a_r [m].

    Args:
        mass: Mass of the robot [kg].
        i_rob: Moment of inertia about the x axis through the CoM [kg m^2].
        b_r: Height of the CoM above the floor [m].

    Raises:
        ValueError: An argument is not finite and positive.
    """
    _require_positive(mass=mass, i_rob=i_rob, b_r=b_r)
    return i_rob / (mass * b_r)


def foot_impulse_planar(mass: float, i_rob: float, a_r: float, b_r: float) -> float:
    """Impulse of the floor at C along the door's normal for 1 N s given to the door [-].

    The robot is a rigid body that turns about C, which is b_r below its CoM. The impulse is zero
    where eq. (5) holds, and positive where the floor pushes the robot towards the door.

    Args:
        mass: Mass of the robot [kg].
        i_rob: Moment of inertia about the x axis through the CoM [kg m^2].
        a_r: Height of B above the CoM [m].
        b_r: Height of the CoM above the floor [m].

    Raises:
        ValueError: Mass, moment of inertia or b_r is not finite and positive.
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
    """Speeds of B that give the door an angular velocity: eqs. (2) and (4), with restitution.

    Args:
        omega: Angular velocity w' of the door after the hit [rad/s].
        i_a: Moment of inertia of the door about its hinge [kg m^2].
        l_b: Distance of B from the hinge [m].
        effective_mass: m_re of the robot at B [kg].
        restitution: Coefficient of restitution e, 0 (plastic) to 1.
        braking: Angular impulse of closer and hinge friction during the contact, which the hit
            must supply too [N m s].

    Returns:
        The speeds before and after the hit and the impulse.

    Raises:
        ValueError: An argument is not finite and positive, or e is outside [0, 1].
    """
    _require_positive(omega=omega, i_a=i_a, l_b=l_b, effective_mass=effective_mass)
    _require_restitution(restitution)
    impulse = (i_a * omega + braking) / l_b  # eq. (2): m_re (v_rB - v'_rB) l_B = I_A w'
    # Eq. (4) with v'_rB = w' l_B - e v_rB.
    v_rb = (impulse / effective_mass + omega * l_b) / (1.0 + restitution)
    return ImpactSpeeds(v_rb=v_rb, v_rb_post=omega * l_b - restitution * v_rb, impulse=impulse)


def omega_for(
    v_rb: float,
    *,
    i_a: float,
    l_b: float,
    effective_mass: float,
    restitution: float,
    braking: float = 0.0,
) -> float:
    """Angular velocity w' of the door after a hit at the speed v_rB [rad/s].

    This is the inverse of `speeds_for`, with the same units and errors.
    """
    _require_positive(v_rb=v_rb, i_a=i_a, l_b=l_b, effective_mass=effective_mass)
    _require_restitution(restitution)
    reach = l_b * effective_mass
    return ((1.0 + restitution) * v_rb - braking / reach) / (i_a / reach + l_b)


def _require_restitution(restitution: float) -> None:
    """Raise ValueError where a coefficient of restitution is outside 0 to 1."""
    if not 0.0 <= restitution <= 1.0:
        raise ValueError(f"restitution must be between 0 and 1, not {restitution}")


def _require_positive(**values: float) -> None:
    """Raise ValueError with the name of the first value that is not finite and positive."""
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be finite and above 0, not {value}")
