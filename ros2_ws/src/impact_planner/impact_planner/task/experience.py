"""Effective mass and restitution learned from earlier hits on a door, and the file for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import InputError
from door_impact_common.files import make_folder, write_whole
from door_impact_common.yaml_files import read_yaml, yaml_text

from impact_planner.errors import InvalidRequest

MASS_FACTORS = (0.3, 3.0)  # least and largest factor on the model's effective mass in a file
_MASS_STD = 0.1  # relative standard deviation of the effective mass before any hit
_RESTITUTION_STD = 0.1  # standard deviation of the restitution before any hit


@dataclass(frozen=True)
class Limits:
    """What effective mass and restitution can be; whatever hits show, learning stays within them.

    Attributes:
        mass_factor: Least and largest factor on the model's effective mass.
        restitution: Least and largest coefficient of restitution.
    """

    mass_factor: tuple[float, float] = (0.7, 1.25)
    restitution: tuple[float, float] = (0.3, 0.7)


@dataclass(frozen=True)
class Experience:
    """Knowledge from hits on one door.

    Attributes:
        hits: Number of hits that the knowledge comes from.
        mass_factor: Factor on the model's effective mass at B.
        restitution: Coefficient of restitution.
        covariance: Covariance of the factor's logarithm and the restitution, (2, 2).
    """

    hits: int
    mass_factor: float
    restitution: float
    covariance: Array

    @classmethod
    def none(cls, restitution: float) -> Experience:
        """Make the state before the first hit, with the configured restitution."""
        return cls(0, 1.0, restitution, np.diag([_MASS_STD, _RESTITUTION_STD]) ** 2)

    def outside(self, limits: Limits) -> str:
        """Name the figure outside the limits and its limits in a clause; empty if none is."""
        for name, value, (low, high) in (
                ("restitution", self.restitution, limits.restitution),
                ("effective mass", self.mass_factor, limits.mass_factor)):
            if not low <= value <= high:
                times = " times the model's" if name == "effective mass" else ""
                return f"the {name} of {value:.3f}{times} is not from {low:g} to {high:g}{times}"
        return ""


def load(path: Path) -> dict[str, Experience]:
    """Read the experience of each door; a missing or empty file holds none.

    Raises:
        InvalidRequest: The file cannot be read, or its content is not what `save` writes.
    """
    try:
        document = read_yaml(path)
        if document is None:
            return {}
        return {str(door): _checked(**entry) for door, entry in document.items()}
    except InputError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            return {}
        raise InvalidRequest(
            f"experience_file {error}", quantity="experience_file", value=str(path)) from error
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InvalidRequest(
            f"experience_file {path} cannot be read as experience of hits: {error}; correct or "
            "remove the file", quantity="experience_file", value=str(path)) from error


def _checked(
    hits: int, mass_factor: float, restitution: float, covariance: list[list[float]]
) -> Experience:
    """Make experience of an entry of the file.

    Raises:
        ValueError: A value is outside its range.
    """
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
    """Write the experience of each door; an interrupted write leaves the old file as it was.

    Raises:
        OutputError: The file cannot be written.
    """
    make_folder(path.parent)
    document = {
        door: {"hits": one.hits, "mass_factor": one.mass_factor, "restitution": one.restitution,
               "covariance": one.covariance.tolist()}
        for door, one in sorted(known.items())
    }
    write_whole(path, yaml_text(document))
