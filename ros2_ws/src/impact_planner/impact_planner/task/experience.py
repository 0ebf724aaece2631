"""What earlier hits on a door have taught, and the file that keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from door_impact_common.arrays import Array

from impact_planner.errors import ExperienceUnreadable

MASS_FACTORS = (0.3, 3.0)  # of the effective mass that are believed
_MASS_STD = 0.1  # before any hit, as a share
_RESTITUTION_STD = 0.1  # the same


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
            and MASS_FACTORS[0] <= mass_factor <= MASS_FACTORS[1]):
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
