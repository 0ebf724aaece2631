r"""Stiffness and damping of the leaf's surface for a wanted coefficient of restitution.

PyBullet's `restitution` has no effect between these bodies, but its contact stiffness and damping
have one. Its solver treats them as an implicit spring-damper that cannot pull. This scheme loses
some speed by itself, so the damping is found by simulating the same scheme for two free masses
before the world is built (`door_model.door.surface` is the limit of short steps). For a reduced
mass `mu`, a penetration `x` and a step `h`,

    mu (v_{n+1} - v_n) / h = -max(0, k (x_n + h v_{n+1}) + c v_{n+1}).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig
from door_model.door.surface import mass_of_hit
from scipy.optimize import brentq

from hrp2_sim_bridge.settings import WorldSettings

_PHASES = 16  # instants within a step at which the first contact may fall; results are their means
_SOFTEST, _STIFFEST = 0.0, 8.0  # range of the damping ratio
_ROUNDS = 4  # iterations that match the duration
_SETTLED = 200.0  # longest contact that is simulated, in units of 1 / natural frequency


@dataclass(frozen=True)
class ContactDesign:
    """Surface of the leaf.

    Attributes:
        stiffness: Stiffness of the contact [N/m].
        damping: Damping of the contact [N s/m].
        restitution: Coefficient of restitution that two free masses will show.
        duration: Duration of that contact [s].
        reduced_mass: Reduced mass for which the surface was designed [kg].
    """

    stiffness: float
    damping: float
    restitution: float
    duration: float
    reduced_mass: float


def simulate_impact(frequency: float, ratio: float, step: float) -> tuple[float, float]:
    """Simulate one impact with the solver's scheme and physics steps [s].

    Args:
        frequency: Natural frequency sqrt(k / mu) [rad/s].
        ratio: Damping ratio c / (2 sqrt(k mu)).
        step: Physics step [s].

    Returns:
        Restitution and duration [s], means over the instants at which the contact may begin.
    """
    k, c = frequency**2, 2.0 * ratio * frequency  # per unit of reduced mass
    x = -step * (np.arange(_PHASES) + 0.5) / _PHASES
    v = np.ones(_PHASES)
    touching = np.zeros(_PHASES)
    for _ in range(int(_SETTLED / (frequency * step))):
        # Speculative contact: a gap that closes within the step counts already, minus the gap.
        free = np.where(x > 0.0, k * (x + step * v) + c * v, 0.0)
        gain = 1.0 + step * (step * k + c)
        force = np.maximum(free, 0.0) / gain
        v = v - step * force
        x = x + step * v
        touching += force > 0.0
        if (v < 0.0).all() and (force <= 0.0).all():
            break
    return float(-v.mean()), float(touching.mean() * step)


def design_contact(
    restitution: float, mass: float, duration: float, step: float
) -> ContactDesign:
    """Find the stiffness and damping that show a coefficient of restitution.

    Args:
        restitution: Wanted coefficient of restitution, from 0 to about 0.9.
        mass: Reduced mass of the two bodies [kg].
        duration: Wanted duration of the contact [s].
        step: Physics step during the impact [s].

    Raises:
        SettingError: The restitution is negative or larger than a step of this length can show.
    """
    if not (np.isfinite(restitution) and restitution >= 0.0):
        raise SettingError("restitution", restitution, "0 or more")
    frequency = np.pi / duration
    ratio = 0.0
    for _ in range(_ROUNDS):
        ratio = _damping_ratio(restitution, frequency, step)
        _, took = simulate_impact(frequency, ratio, step)
        # A plastic contact does not end by itself, so its duration cannot always be reached.
        frequency *= float(np.clip(took / duration, 0.5, 1.5))
    ratio = _damping_ratio(restitution, frequency, step)
    shown, took = simulate_impact(frequency, ratio, step)
    return ContactDesign(
        stiffness=mass * frequency**2,
        damping=2.0 * ratio * frequency * mass,
        restitution=shown,
        duration=took,
        reduced_mass=mass)


def design_leaf(door: DoorConfig, hinge_x: float, settings: WorldSettings) -> ContactDesign:
    """Design the surface of a leaf for a hit at x = 0, with the hinge at x [m].

    The door's restitution counts where the settings have none.

    Raises:
        SettingError: A step of this length cannot show the restitution.
    """
    wanted = settings.restitution
    return design_contact(
        door.restitution if wanted is None else wanted,
        mass_of_hit(door.i_a, hinge_x),
        settings.contact_duration,
        settings.time_step_fine)


def _damping_ratio(restitution: float, frequency: float, step: float) -> float:
    """Find the damping ratio for a restitution; a plastic hit gets the largest damping."""
    most, _ = simulate_impact(frequency, _SOFTEST, step)
    if restitution > most:
        limit = f"at most {most:.3f} with a step of {step} s"
        raise SettingError("restitution", restitution, limit)
    least, _ = simulate_impact(frequency, _STIFFEST, step)
    if restitution <= least:
        return _STIFFEST
    return float(
        brentq(
            lambda ratio: simulate_impact(frequency, ratio, step)[0] - restitution,
            _SOFTEST, _STIFFEST, xtol=1e-5))
