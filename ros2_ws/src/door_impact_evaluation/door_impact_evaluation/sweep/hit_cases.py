"""Cases of the hits: doors, desired angles and perturbations, drawn at random from a seed."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from door_model.door.config import DoorConfig, load_door
from door_model.identification.identify import identify
from door_model.identification.scale import scale_from_leaf
from door_model.recording.synthetic import synthetic_recording
from impact_planner.task.known_door import KnownDoor

DOOR_OFF = 0.02            # largest error of the surveyed distance of the door [m]
CLOSER = 0.1               # largest relative change of c_c, k_c and tau'_c0
RESTITUTION = 0.03         # largest change of the coefficient of restitution in group perturbed
ROTORS = (0.9, 1.1)        # range of the factor of the rotors' inertia in group perturbed
FRICTION = (0.5, 1.0)      # range of the friction coefficient of the soles
STIFFNESS = (0.7, 1.3)     # range of the factors of gears and pads in group perturbed
ROUGH_RESTITUTION = 0.1    # largest change of the coefficient of restitution in group rough
ROUGH_ROTORS = (0.7, 1.4)  # range of the factor of the rotors' inertia in group rough
ROUGH_STIFFNESS = (0.5, 2.0)  # range of the factors of gears and pads in group rough
PEAKS_DEG = (10.0, 32.0)   # range of the largest angles of the pushes by hand [deg]
PUSHES = 5                 # pushes by hand from which a door is identified

# Door, desired angle [deg] and run-up of each nominal case.
NOMINAL = tuple(("paper", target, "mcv50") for target in (15.0, 20.0, 25.0, 30.0)) + tuple(
    (door, 25.0, "zmp_limited") for door in ("size2", "size3"))


@dataclass(frozen=True)
class HitCase:
    """One simulated door, the hits on it and the perturbations, which the planner does not know.

    Attributes:
        group: nominal, without perturbations; perturbed, hit once; or rough, with larger
            perturbations and a second hit that uses what the first has taught.
        index: Number within the group, from 0.
        door: Name of the door.
        target_deg: Desired opening angle [deg].
        run_up: Profile of the run-up, mcv50 or zmp_limited.
        hits: Number of hits; each plan uses what the hits before have taught.
        seed: Seed of the sensors' noise in the first hit; later hits add their number to it.
        door_offset: Distance by which the door stands farther away than surveyed [m].
        closer: Factors by which c_c, k_c and tau'_c0 differ from the configured door's.
        restitution: Coefficient of restitution; None means the configured one.
        rotor_scale: Factor by which the rotors' inertia differs from the model's.
        friction: Friction coefficient of the soles.
        gear_scale: Factor by which the gears' stiffness differs from the model's.
        pad_scale: Factor by which the stiffness of the brace's pads differs from the model's.
        pushes_deg: Largest angles of the swings from which the door is identified [deg]; if empty,
            the planner knows the door exactly.
        phase: Angle of the closed door within an encoder count, from 0 to 1.
    """

    group: str
    index: int
    door: str = "paper"
    target_deg: float = 25.0
    run_up: str = "mcv50"
    hits: int = 1
    seed: int = 0
    door_offset: float = 0.0
    closer: tuple[float, float, float] = (1.0, 1.0, 1.0)
    restitution: float | None = None
    rotor_scale: float = 1.0
    friction: float = 0.8
    gear_scale: float = 1.0
    pad_scale: float = 1.0
    pushes_deg: tuple[float, ...] = ()
    phase: float = 0.5

    @property
    def name(self) -> str:
        """Name of the case, unique within a sweep."""
        return f"{self.group}-{self.index}"

    def config(self) -> DoorConfig:
        """Returns the simulated door."""
        plain = load_door(self.door)
        c_c, k_c, tau = self.closer
        return replace(plain, c_c=c_c * plain.c_c, k_c=k_c * plain.k_c,
                       tau_c0_prime=tau * plain.tau_c0_prime)

    def known(self) -> KnownDoor:
        """Returns what the planner knows of the door before the first hit.

        It is identified from the door's own simulated swings, or known exactly without pushes.
        """
        config = self.config()
        if not self.pushes_deg:
            return KnownDoor.configured(config)
        recording = synthetic_recording(
            config.door(), np.radians(self.pushes_deg).tolist(), phase=self.phase)
        leaf = config.leaf
        found = identify(
            recording, config.linkage, scale_from_leaf(leaf.mass, leaf.width))
        return KnownDoor(config.name, found.door, leaf.width, found.names, found.covariance)

    def world(self, hit: int) -> dict[str, Any]:
        """Returns the settings of the simulated world.

        Args:
            hit: Number of the hit, from 0.
        """
        return {"seed": self.seed + hit, "restitution": self.restitution,
                "rotor_scale": self.rotor_scale, "friction": self.friction,
                "gear_scale": self.gear_scale, "pad_scale": self.pad_scale}

    def as_json(self) -> dict[str, Any]:
        """Returns the case as it is written to a record."""
        return asdict(self) | {"closer": list(self.closer), "pushes_deg": list(self.pushes_deg)}


def hit_cases(n: int, seed: int) -> list[HitCase]:
    """Draws the cases of a sweep.

    A longer sweep of the same seed begins, in each group, with the cases of a shorter one.

    Args:
        n: Number of cases in the group perturbed and in the group rough.
        seed: Seed of the random numbers.
    """
    nominal = [HitCase("nominal", index, door=door, target_deg=target, run_up=run_up, hits=2)
               for index, (door, target, run_up) in enumerate(NOMINAL)]
    drawn = [_drawn(group, index, seed) for group in ("perturbed", "rough") for index in range(n)]
    return nominal + drawn


def _drawn(group: str, index: int, seed: int) -> HitCase:
    rough = group == "rough"
    random = np.random.default_rng([seed, index, int(rough)])
    off = ROUGH_RESTITUTION if rough else RESTITUTION
    stiffness = ROUGH_STIFFNESS if rough else STIFFNESS
    return HitCase(
        group, index, hits=2 if rough else 1, seed=int(random.integers(1 << 30)),
        door_offset=float(random.uniform(-DOOR_OFF, DOOR_OFF)),
        closer=tuple(random.uniform(1.0 - CLOSER, 1.0 + CLOSER, 3).tolist()),
        restitution=load_door("paper").restitution + float(random.uniform(-off, off)),
        rotor_scale=float(random.uniform(*(ROUGH_ROTORS if rough else ROTORS))),
        friction=float(random.uniform(*FRICTION)),
        pushes_deg=tuple(random.uniform(*PEAKS_DEG, PUSHES).tolist()),
        phase=float(random.uniform()),
        gear_scale=_factor(random, stiffness), pad_scale=_factor(random, stiffness))


def _factor(random: np.random.Generator, bounds: tuple[float, float]) -> float:
    """Draws a factor whose logarithm is uniformly distributed."""
    return float(np.exp(random.uniform(*np.log(bounds))))
