"""What a sweep runs: doors, targets and perturbations, drawn from a seed."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from door_model.door.config import DoorConfig, load_door
from door_model.identification.identify import identify
from door_model.identification.scale import scale_from_leaf
from door_model.recording.synthetic import synthetic_recording
from impact_planner.task.known_door import KnownDoor

DOOR_OFF = 0.02          # [m] farther or nearer than surveyed
CLOSER = 0.1             # share of c_c, k_c, tau'_c0
RESTITUTION = 0.03       # of that of a first hit
ROTORS = (0.9, 1.1)
FRICTION = (0.5, 1.0)    # of the soles
ROUGH_RESTITUTION = 0.1  # where a hit before has taught
ROUGH_ROTORS = (0.7, 1.4)
PEAKS_DEG = (10.0, 32.0)  # of the pushes by hand
PUSHES = 5

NOMINAL = tuple(("paper", target, "mcv50") for target in (15.0, 20.0, 25.0, 30.0)) + tuple(
    (door, 25.0, "zmp_limited") for door in ("size2", "size3"))


@dataclass(frozen=True)
class Case:
    """A door, how it is known, and how often it is hit.

    Attributes:
        group: nominal; perturbed: unknown before the hit; rough: less known, with a hit before.
        index: Number in its group.
        door: Name.
        target_deg: Desired angle [deg].
        run_up: mcv50 or zmp_limited.
        hits: The later ones with what those before taught.
        seed: Of the sensors' noise; other for each hit.
        door_offset: How much farther the door stands than surveyed [m].
        closer: Factors of c_c, k_c and tau'_c0.
        restitution: Of the leaf; None: as configured.
        rotor_scale: Of the rotors' inertia.
        friction: Of the soles.
        pushes_deg: Peaks of the swings that the door is identified from; none: known exactly.
        phase: Where the closed door stands within its count.
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
    pushes_deg: tuple[float, ...] = ()
    phase: float = 0.5

    @property
    def name(self) -> str:
        """Its name within a sweep."""
        return f"{self.group}-{self.index}"

    def config(self) -> DoorConfig:
        """The simulated door."""
        plain = load_door(self.door)
        c_c, k_c, tau = self.closer
        return replace(plain, c_c=c_c * plain.c_c, k_c=k_c * plain.k_c,
                       tau_c0_prime=tau * plain.tau_c0_prime)

    def known(self) -> KnownDoor:
        """What is known of it before the first hit: identified from its own swings."""
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
        """Settings of the simulated world for a hit, 0 being the first."""
        return {"seed": self.seed + hit, "restitution": self.restitution,
                "rotor_scale": self.rotor_scale, "friction": self.friction}

    def as_json(self) -> dict[str, Any]:
        """For the record."""
        return asdict(self) | {"closer": list(self.closer), "pushes_deg": list(self.pushes_deg)}


def cases(n: int, seed: int) -> list[Case]:
    """All cases of a sweep: the nominal doors, n perturbed ones and n rough ones.

    The first ones of a longer sweep are those of a shorter one.
    """
    nominal = [Case("nominal", index, door=door, target_deg=target, run_up=run_up, hits=2)
               for index, (door, target, run_up) in enumerate(NOMINAL)]
    drawn = [_drawn(group, index, seed) for group in ("perturbed", "rough") for index in range(n)]
    return nominal + drawn


def _drawn(group: str, index: int, seed: int) -> Case:
    rough = group == "rough"
    random = np.random.default_rng([seed, index, int(rough)])
    off = ROUGH_RESTITUTION if rough else RESTITUTION
    return Case(
        group, index, hits=2 if rough else 1, seed=int(random.integers(1 << 30)),
        door_offset=float(random.uniform(-DOOR_OFF, DOOR_OFF)),
        closer=tuple(random.uniform(1.0 - CLOSER, 1.0 + CLOSER, 3).tolist()),
        restitution=load_door("paper").restitution + float(random.uniform(-off, off)),
        rotor_scale=float(random.uniform(*(ROUGH_ROTORS if rough else ROTORS))),
        friction=float(random.uniform(*FRICTION)),
        pushes_deg=tuple(random.uniform(*PEAKS_DEG, PUSHES).tolist()),
        phase=float(random.uniform()))
