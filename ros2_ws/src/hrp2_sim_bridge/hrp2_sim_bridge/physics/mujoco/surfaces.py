r"""Contacts as spring-dampers in N/m and N s/m.

MuJoCo's contacts are soft constraints. With an acceleration `a`, a velocity `v` and a
penetration `x` along the normal, the normal force of a contact that presses obeys

    f = D (-a_n - b v_n + k x),

where v_n is the speed of separation, and MuJoCo computes `D = d / ((1 - d) A)` from the
impedance d (`solimp`) and an inverse mass A that it assigns to the pair of bodies. Given A, any
virtual mass D can be chosen by d, and any stiffness D k and damping D b by `solref`. The scheme of
`hrp2_sim_bridge.physics.contact`, which is implicit in the velocity, is met exactly by
`D = h (c + h k_0)` for a stiffness `k_0`, a damping c and a step h.

A contact that slides with a speed u along the surface gets an additional force
`mu D u / h`, because MuJoCo's cone of friction couples normal and tangent. Where that force
matters, in a hit, the virtual mass must be small. The damping is then explicit, and stiffness and
damping are smaller by the ratio of the moved masses, so that two bodies with the reduced mass for
which the surface was designed move exactly as before.

Source: "Computation", chapters "Constraint model" and "Solver parameters", of MuJoCo's
documentation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

_LEAST_MASS = 0.02  # smallest virtual mass of a contact [kg]
# Explicit damping is stable up to h c = 2 m. MuJoCo's inverse mass is a mean over directions, along
# one of which a body may show a fraction of that mass m; so h c is kept below this share of it.
_STABLE_SHARE = 0.25
# Ratio of the virtual masses of friction and normal contact: large, so that soles do not creep.
# From 1e6 on MuJoCo's solver reports problems that are not convex.
FRICTION_RATIO = 1e5
GRIP = 0.9999  # impedance of constraints that are rigid; the largest that MuJoCo accepts
_GRIP_SHARE = 0.1  # share of an error that a rigid constraint removes in a step


@dataclass(frozen=True)
class Surface:
    """A surface as one contact point shows it.

    Attributes:
        stiffness: Stiffness [N/m].
        damping: Damping [N s/m].
        friction: Coefficient of friction.
        reduced_mass: Reduced mass of a hit for which the surface was designed [kg]; None where
            nothing hits, so that the contact is implicit.
    """

    stiffness: float
    damping: float
    friction: float
    reduced_mass: float | None = None


def set_surface(model: Any, pair: int, surface: Surface, step: float) -> None:
    """Give a pair of geoms the surface, for physics steps of one length.

    Args:
        model: MuJoCo's model.
        pair: Index of the pair.
        surface: Surface.
        step: Physics step [s].
    """
    damping = surface.damping + step * surface.stiffness
    bodies = model.geom_bodyid[[model.pair_geom1[pair], model.pair_geom2[pair]]]
    inverse = float(model.body_invweight0[bodies, 0].sum())
    implicit = step * damping
    virtual, scale = implicit, 1.0
    if surface.reduced_mass is not None:
        virtual = min(max(implicit - _STABLE_SHARE / inverse, _LEAST_MASS), implicit)
        scale = (surface.reduced_mass + virtual) / (surface.reduced_mass + implicit)
    impedance = inverse * virtual / (1.0 + inverse * virtual)
    share = scale * impedance / virtual
    model.pair_solimp[pair, :2] = impedance
    model.pair_solref[pair] = -share * surface.stiffness, -share * damping
    model.pair_solreffriction[pair] = 0.0, -impedance / step


def set_grips(model: Any, step: float) -> None:
    """Make equality constraints and limits of joints as stiff as a step allows.

    Args:
        model: MuJoCo's model.
        step: Physics step [s].
    """
    reference = np.array([-GRIP * _GRIP_SHARE / step**2, -GRIP / step])
    model.eq_solref[:], model.jnt_solref[:] = reference, reference
    model.eq_solimp[:, :2] = model.jnt_solimp[:, :2] = GRIP
