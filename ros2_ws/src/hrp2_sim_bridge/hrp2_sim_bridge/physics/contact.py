r"""Stiffness and damping of the leaf's surface for a wanted coefficient of restitution.

PyBullet's `restitution` has no effect between these bodies, its contact stiffness and damping do.
Its solver treats them as an implicit spring-damper that cannot pull, which loses some speed of its
own; so the damping is found by running that very scheme for two free masses, before any robot is
there. For a reduced mass :math:`\mu`, penetration :math:`x` and step :math:`h`,

.. math:: \mu (v_{n+1} - v_n) / h = -\max(0, k (x_n + h v_{n+1}) + c v_{n+1}).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig
from scipy.optimize import brentq

from hrp2_sim_bridge.settings import WorldSettings

_PHASES = 16  # first contact falls anywhere within a step: the mean over so many places
_SOFTEST, _STIFFEST = 0.0, 8.0  # range of the damping ratio
_ROBOT_MASS = 58.0  # free mass at point B that a leaf is designed for: what it shows in a hit [kg]
_LEAST_LEVER = 0.1  # of a hit [m]
_ROUNDS = 4  # of matching the duration
_SETTLED = 200.0  # longest contact followed, in units of 1 / natural frequency


@dataclass(frozen=True)
class ContactDesign:
    """Surface of the leaf.

    Attributes:
        stiffness: [N/m].
        damping: [N s/m].
        restitution: coefficient of restitution that two free masses will show.
        duration: of that contact [s].
        reduced_mass: it was designed for [kg].
    """

    stiffness: float
    damping: float
    restitution: float
    duration: float
    reduced_mass: float


def reduced_mass(first: float, second: float) -> float:
    """Mass that moves as the distance of two free masses does [kg]."""
    return first * second / (first + second)


def simulate_impact(frequency: float, ratio: float, step: float) -> tuple[float, float]:
    """Run the solver's scheme through one impact.

    Args:
        frequency: natural frequency sqrt(k / mu) [rad/s].
        ratio: damping ratio c / (2 sqrt(k mu)).
        step: physics step [s].

    Returns:
        coefficient of restitution and duration of contact [s], means over where within a step the
        contact begins.
    """
    k, c = frequency**2, 2.0 * ratio * frequency  # per unit of reduced mass
    x = -step * (np.arange(_PHASES) + 0.5) / _PHASES
    v = np.ones(_PHASES)
    touching = np.zeros(_PHASES)
    for _ in range(int(_SETTLED / (frequency * step))):
        # Speculative contact: a gap that closes within the step already counts, less the gap.
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
    """Find stiffness and damping.

    Args:
        restitution: wanted, 0 to about 0.9; what the scheme cannot reach is an error.
        mass: reduced mass of the two bodies [kg].
        duration: wanted duration of contact [s].
        step: physics step around the impact [s].

    Raises:
        SettingError: restitution outside 0 .. what a step of this length can show.
    """
    if not (np.isfinite(restitution) and restitution >= 0.0):
        raise SettingError("restitution", restitution, "0 or more")
    frequency = np.pi / duration
    ratio = 0.0
    for _ in range(_ROUNDS):
        ratio = _damping_ratio(restitution, frequency, step)
        _, took = simulate_impact(frequency, ratio, step)
        # A plastic contact never ends by itself; its duration is not a meaningful target.
        frequency *= float(np.clip(took / duration, 0.5, 1.5))
    ratio = _damping_ratio(restitution, frequency, step)
    shown, took = simulate_impact(frequency, ratio, step)
    return ContactDesign(
        stiffness=mass * frequency**2,
        damping=2.0 * ratio * frequency * mass,
        restitution=shown,
        duration=took,
        reduced_mass=mass,
    )


def leaf_contact(door: DoorConfig, hinge_x: float, settings: WorldSettings) -> ContactDesign:
    """Surface of a leaf for a free mass that hits it abreast of the origin, where the robot stands.

    Args:
        door: its inertia, and its restitution if the settings leave it open.
        hinge_x: place of the hinge [m].
        settings: restitution, duration of contact, physics step near the leaf.

    Raises:
        SettingError: A restitution that a step of this length cannot show.
    """
    wanted = settings.restitution
    lever = max(abs(hinge_x), _LEAST_LEVER)
    return design_contact(
        door.restitution if wanted is None else wanted,
        reduced_mass(_ROBOT_MASS, door.i_a / lever**2),
        settings.contact_duration,
        settings.time_step_fine,
    )


def _damping_ratio(restitution: float, frequency: float, step: float) -> float:
    """Damping ratio for a restitution; the heaviest damping stands for a plastic hit."""
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
            _SOFTEST, _STIFFEST, xtol=1e-5,
        )
    )
