"""What hits on a door teach about the next one: effective mass and restitution.

Both are the least certain figures of eqs. (2) to (4): how stiff drives and brace are, what the
elbow meets. A hit shows them. Its peak angle tells w' by eq. (1), joints and gyro tell v'_rB, and a
Kalman filter corrects the two; how sure each was decides which of them is corrected.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import yaml
from door_model.dynamics import initial_velocity
from numpy.typing import NDArray

from . import momentum
from .errors import ExperienceUnreadable

if TYPE_CHECKING:
    from .plan_types import ImpactPlan, KnownDoor

Array = NDArray[np.float64]

_MASS_STD = 0.1  # before any hit, as a share
_RESTITUTION_STD = 0.1  # the same
_FORGOTTEN = 0.01  # how far both may drift from one hit to the next
_OMEGA_STD = 0.01  # of w' by the peak, as a share
_V_POST_STD = 0.03  # of v'_rB [m/s]
_FACTORS = (0.3, 3.0)  # of the effective mass that are believed
_BELIEVED = 0.6  # of a w' that differs from the expected one, as a logarithm: a door was blocked
_STEP = 1e-5  # of differences


@dataclass(frozen=True)
class Experience:
    """What is known of hits on a door.

    Attributes:
        hits: How many taught it.
        mass_factor: Of the effective mass that the model says.
        restitution: Coefficient of restitution.
        covariance: Of the factor's logarithm and the restitution, (2, 2).
    """

    hits: int
    mass_factor: float
    restitution: float
    covariance: Array

    @classmethod
    def none(cls, restitution: float) -> Experience:
        """Before the first hit, with the restitution that is configured."""
        return cls(0, 1.0, restitution, np.diag([_MASS_STD, _RESTITUTION_STD]) ** 2)


@dataclass(frozen=True)
class Hit:
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

    @classmethod
    def of(cls, plan: ImpactPlan, known: KnownDoor, peak_angle: float, v_rb_post: float) -> Hit:
        """From a plan and what came of it.

        Args:
            plan: That was executed.
            known: The door that it was made for.
            peak_angle: To which the door opened [rad].
            v_rb_post: Speed of B after the hit [m/s]; NaN: not known.

        Raises:
            DoorModelError: The door cannot have opened to that angle.
        """
        omega = float(initial_velocity(known.door, peak_angle, plan.initial_angle))
        return cls(plan.effective_mass_model, known.door.i_a, plan.l_b, plan.v_rb, v_rb_post,
                   omega, plan.braking)


def learn(before: Experience, hit: Hit) -> Experience:
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
    return after if _FACTORS[0] <= after.mass_factor <= _FACTORS[1] else before


def _corrected(before: Experience, hit: Hit) -> Experience:
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


def _shown(hit: Hit, state: Array) -> Array:
    """Logarithm of w', and v'_rB, of a hit with a mass and a restitution, (2,)."""
    restitution = float(state[1])
    mass = hit.model_mass * math.exp(state[0])
    # The factor outside, for a restitution beyond its range on the way.
    omega = momentum.omega_for(
        (1.0 + restitution) * hit.v_rb, i_a=hit.i_a, l_b=hit.l_b, effective_mass=mass,
        restitution=0.0, braking=hit.braking)
    return np.array([math.log(omega), omega * hit.l_b - restitution * hit.v_rb])


def load(path: Path) -> dict[str, Experience]:
    """Experience by door; none where there is no file.

    Raises:
        ExperienceUnreadable: The file is not one of `save`.
    """
    try:
        if not path.exists():
            return {}
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
        if document is None:
            return {}
        return {str(door): _checked(**entry) for door, entry in document.items()}
    except (OSError, UnicodeDecodeError, yaml.YAMLError, TypeError, ValueError, AttributeError,
            RecursionError, OverflowError) as error:
        raise ExperienceUnreadable(
            f"{path} holds no experience of hits: {error}", quantity="experience_file",
            value=str(path)) from error


def _checked(
    hits: int, mass_factor: float, restitution: float, covariance: list[list[float]]
) -> Experience:
    spread = np.array(covariance, dtype=float)
    sound = (spread.shape == (2, 2) and bool(np.isfinite(spread).all())
             and bool(np.allclose(spread, spread.T, atol=0.0))
             and bool((np.linalg.eigvalsh(spread) >= 0.0).all()))
    if not (sound and isinstance(hits, int) and hits >= 1 and 0.0 <= restitution <= 1.0
            and _FACTORS[0] <= mass_factor <= _FACTORS[1]):
        raise ValueError(f"hits {hits}, mass_factor {mass_factor}, restitution {restitution}, "
                         f"covariance {covariance}")
    return Experience(hits, float(mass_factor), float(restitution), spread)


def save(path: Path, known: Mapping[str, Experience]) -> None:
    """Writes experience by door, whole or not at all.

    Raises:
        OSError: It cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    document = {
        door: {"hits": one.hits, "mass_factor": one.mass_factor, "restitution": one.restitution,
               "covariance": one.covariance.tolist()}
        for door, one in sorted(known.items())
    }
    part = path.with_suffix(path.suffix + ".part")
    part.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    part.replace(path)
