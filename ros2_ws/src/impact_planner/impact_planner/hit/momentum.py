"""Momentum transfer from the robot to the door: eqs. (2) to (5) of sections II.C.3 and II.C.4.

Speeds are positive towards the door. In the paper's letters:

- eq. (2): ``m_re v_rB l_B = m_re v'_rB l_B + I_A w'``, angular momentum about the hinge A;
- eq. (3): ``m_re = I_rob m / (I_rob + a_r^2 m)``, effective mass at B;
- eq. (4): ``v_rB = I_A w' / (m_re l_B) + v'_rB``, which is misprinted in the paper and follows
  from (2) and (3);
- eq. (5): ``b_r = I_rob / (m a_r)``, center of percussion on the floor.

Eq. (4) leaves v'_rB free. The coefficient of restitution e closes it:
``w' l_B - v'_rB = e v_rB``.

Arguments are finite and positive: mass m of the robot [kg], its moment of inertia i_rob about the x
axis through the CoM [kg m^2], heights a_r of B above the CoM and b_r of the CoM above the floor
[m], moment of inertia i_a of the door about its hinge [kg m^2], distance l_b of B from the hinge
[m], effective_mass m_re [kg], restitution e from 0 (plastic) to 1, and braking, the angular impulse
of closer and hinge friction during the contact, which the hit must supply too [N m s].
"""

from __future__ import annotations

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
    """Compute the effective mass m_re at B of a free body in the frontal plane, eq. (3) [kg]."""
    return i_rob * mass / (i_rob + a_r**2 * mass)


def percussion_height(mass: float, i_rob: float, a_r: float) -> float:
    """Compute the height b_r that puts the center of percussion on the floor, eq. (5) [m]."""
    return i_rob / (mass * a_r)


def foot_impulse_planar(mass: float, i_rob: float, a_r: float, b_r: float) -> float:
    """Compute the impulse of the floor at C along the leaf's normal per impulse on the door.

    The robot is a rigid body that turns about C, which is b_r below its CoM. The impulse is zero
    where eq. (5) holds, and positive where the floor pushes the robot towards the door.
    """
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
    """Compute the speeds of B that give the door w' = omega [rad/s], by eqs. (2) and (4) and e."""
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
    """Compute w' of the door after a hit at v_rB [m/s]; the inverse of `speeds_for` [rad/s]."""
    reach = l_b * effective_mass
    return ((1.0 + restitution) * v_rb - braking / reach) / (i_a / reach + l_b)
