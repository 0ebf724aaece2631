"""What hits on a door teach about the next one: effective mass and restitution.

Both are the least certain figures of eqs. (2) to (4): how stiff drives and brace are, what the
elbow meets. A hit shows them. Its peak angle tells w' by eq. (1), joints and gyro tell v'_rB, and a
Kalman filter corrects the two; how sure each was decides which of them is corrected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

from impact_planner.hit import momentum
from impact_planner.task.experience import MASS_FACTORS, Experience

_FORGOTTEN = 0.01  # how far both may drift from one hit to the next
_OMEGA_STD = 0.01  # of w' by the peak, as a share
_V_POST_STD = 0.03  # of v'_rB [m/s]
_BELIEVED = 0.6  # of a w' that differs from the expected one, as a logarithm: a door was blocked
_STEP = 1e-5  # of differences


@dataclass(frozen=True)
class ObservedHit:
    """What a hit has to teach.

    Attributes:
        model_mass: Effective mass by the model [kg].
        i_a: Moment of inertia of the door [kg m^2].
        l_b: Distance of B from the hinge [m].
        v_rb: Of B before the hit, as planned: what the motion does to it is learned, too [m/s].
        v_rb_post: And after it, as measured; NaN: not known [m/s].
        omega: w' that opens the door as far as it went [rad/s].
        braking: Angular impulse that the closer took [N m s].
    """

    model_mass: float
    i_a: float
    l_b: float
    v_rb: float
    v_rb_post: float
    omega: float
    braking: float


def learn(before: Experience, hit: ObservedHit) -> Experience:
    """What is known after a hit.

    Args:
        before: What was known.
        hit: The hit.

    Returns:
        The experience with one hit more; `before` itself where the hit makes no sense.
    """
    try:
        after = _corrected(before, hit)
    except (ValueError, OverflowError):  # no motion of a door on the way
        return before
    return after if MASS_FACTORS[0] <= after.mass_factor <= MASS_FACTORS[1] else before


def _corrected(before: Experience, hit: ObservedHit) -> Experience:
    """The Kalman filter's step.

    Raises:
        ValueError: The hit did not open the door, or no mass and restitution explain it.
        OverflowError: The same.
    """
    state = np.array([math.log(before.mass_factor), before.restitution])
    covariance = before.covariance + _FORGOTTEN**2 * np.eye(2) * (before.hits > 0)
    seen = np.array([math.log(hit.omega), hit.v_rb_post])
    noise = np.array([_OMEGA_STD, _V_POST_STD])
    told = np.isfinite(seen)
    if not told[0]:
        raise ValueError(f"w' of a hit is no number: {hit.omega}")
    if abs(float((seen - _shown(hit, state))[0])) > _BELIEVED:
        raise ValueError(f"w' = {hit.omega:.3f} rad/s is too far from what was expected")
    middle = state
    for _ in range(3):  # nearly linear
        expected = _shown(hit, middle)
        slope = np.column_stack([
            (_shown(hit, middle + step) - expected) / _STEP for step in _STEP * np.eye(2)])[told]
        gain = covariance @ slope.T @ np.linalg.inv(
            slope @ covariance @ slope.T + np.diag(noise[told] ** 2))
        middle = state + gain @ ((seen - expected)[told] - slope @ (state - middle))
        middle[1] = min(max(middle[1], 0.0), 1.0)
    after = (np.eye(2) - gain @ slope) @ covariance
    return Experience(
        before.hits + 1, math.exp(middle[0]), float(middle[1]), 0.5 * (after + after.T))


def _shown(hit: ObservedHit, state: Array) -> Array:
    """Logarithm of w', and v'_rB, of a hit with a mass and a restitution, (2,)."""
    restitution = float(state[1])
    mass = hit.model_mass * math.exp(state[0])
    # The factor outside, for a restitution beyond its range on the way.
    omega = momentum.omega_for(
        (1.0 + restitution) * hit.v_rb, i_a=hit.i_a, l_b=hit.l_b, effective_mass=mass,
        restitution=0.0, braking=hit.braking)
    return np.array([math.log(omega), omega * hit.l_b - restitution * hit.v_rb])
