"""Learning of effective mass and restitution from hits on a door.

Both are the least certain figures of eqs. (2) to (4), because they depend on the stiffness of
drives, brace and contact. A hit reveals them: its peak angle gives w' by eq. (1), and joints and
gyro give v'_rB. A Kalman filter corrects the two figures in proportion to their uncertainty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

from impact_planner.hit import momentum
from impact_planner.task.experience import MASS_FACTORS, Experience

_FORGOTTEN = 0.01  # standard deviation by which both figures may drift between two hits
_OMEGA_STD = 0.01  # relative standard deviation of w' from the peak
_V_POST_STD = 0.03  # standard deviation of the measured v'_rB [m/s]
# Largest accepted difference of ln w' from its expected value; a larger one is a blocked door.
_BELIEVED = 0.6
_STEP = 1e-5  # step of the finite differences
_ITERATIONS = 3  # of the filter's linearisation; the model is nearly linear


@dataclass(frozen=True)
class ObservedHit:
    """Figures of an executed hit from which mass and restitution are learned.

    Attributes:
        model_mass: Effective mass at B by the model [kg].
        i_a: Moment of inertia I_A of the door about its hinge [kg m^2].
        l_b: Distance of B from the hinge [m].
        v_rb: Planned speed of B before the hit [m/s]. The planned one is used, so that errors of
            the motion are learned too.
        v_rb_post: Measured speed of B after the hit [m/s]; NaN means that it was not measured.
        omega: Angular velocity w' that opens the door to its measured peak [rad/s].
        braking: Angular impulse that the closer took from the hit [N m s].
    """

    model_mass: float
    i_a: float
    l_b: float
    v_rb: float
    v_rb_post: float
    omega: float
    braking: float


def learn(before: Experience, observed: ObservedHit) -> Experience:
    """Update the experience with a hit.

    Args:
        before: Experience before the hit.
        observed: The hit.

    Returns:
        The experience with one more hit; `before` itself where the hit is implausible.
    """
    try:
        after = _corrected(before, observed)
    except (ValueError, OverflowError):  # the door cannot have moved like this
        return before
    return after if MASS_FACTORS[0] <= after.mass_factor <= MASS_FACTORS[1] else before


def _corrected(before: Experience, observed: ObservedHit) -> Experience:
    """One step of an iterated extended Kalman filter.

    Its state is the logarithm of the mass factor, and the restitution.

    Raises:
        ValueError: The hit did not open the door, or no mass and restitution explain it.
        OverflowError: The mass that explains the hit is not a finite number.
    """
    state = np.array([math.log(before.mass_factor), before.restitution])
    covariance = before.covariance + _FORGOTTEN**2 * np.eye(2) * (before.hits > 0)
    measured = np.array([math.log(observed.omega), observed.v_rb_post])
    noise = np.array([_OMEGA_STD, _V_POST_STD])
    valid = np.isfinite(measured)
    if not valid[0]:
        raise ValueError(f"w' of a hit must be finite, not {observed.omega}")
    if abs(float((measured - _predicted(observed, state))[0])) > _BELIEVED:
        raise ValueError(f"w' = {observed.omega:.3f} rad/s is too far from its expected value")
    middle = state
    for _ in range(_ITERATIONS):
        expected = _predicted(observed, middle)
        slope = np.column_stack([
            (_predicted(observed, middle + step) - expected) / _STEP
            for step in _STEP * np.eye(2)])[valid]
        gain = covariance @ slope.T @ np.linalg.inv(
            slope @ covariance @ slope.T + np.diag(noise[valid] ** 2))
        middle = state + gain @ ((measured - expected)[valid] - slope @ (state - middle))
        middle[1] = min(max(middle[1], 0.0), 1.0)
    after = (np.eye(2) - gain @ slope) @ covariance
    return Experience(
        before.hits + 1, math.exp(middle[0]), float(middle[1]), 0.5 * (after + after.T))


def _predicted(observed: ObservedHit, state: Array) -> Array:
    """Logarithm of w' and v'_rB [m/s] that a state of the filter predicts for a hit, (2,)."""
    restitution = float(state[1])
    mass = observed.model_mass * math.exp(state[0])
    # The factor 1 + e is applied here, because the filter may try an e outside 0 to 1, which
    # `omega_for` refuses.
    omega = momentum.omega_for(
        (1.0 + restitution) * observed.v_rb, i_a=observed.i_a, l_b=observed.l_b,
        effective_mass=mass, restitution=0.0, braking=observed.braking)
    return np.array([
        math.log(omega), omega * observed.l_b - restitution * observed.v_rb])
