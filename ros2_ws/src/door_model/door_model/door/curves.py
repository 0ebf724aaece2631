"""What a closer does over the opening angle: the data of the paper's Figs. 15 and 16."""

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

from door_model.door.closer import FourBarCloser
from door_model.door.door import Door

_FROM_THE_END = np.radians(1.0)  # [rad]; nearer to a stretched linkage eta grows without bound


@dataclass(frozen=True)
class CloserCurves:
    """A closer over opening angles, each (N,).

    Attributes:
        theta: Opening angles [rad].
        f: Angle of the closer's joint, eq. (8) [rad].
        eta: Reduction ratio, eq. (9) [-].
        torque: Restoring torque, eq. (12) [N m].
        damping_opening: Damping about the hinge c_c eta^2, eq. (13), while the door opens
            [N m s/rad].
        damping_closing: The same while it closes.
        energy: In the spring, above that of the closed door [J].
    """

    theta: Array
    f: Array
    eta: Array
    torque: Array
    damping_opening: Array
    damping_closing: Array
    energy: Array

    def columns(self) -> dict[str, Array]:
        """The curves by name and unit, angles in degrees."""
        return {
            "door_deg": np.degrees(self.theta),
            "closer_deg": np.degrees(self.f),
            "eta": self.eta,
            "restoring_torque_nm": self.torque,
            "damping_opening_nms": self.damping_opening,
            "damping_closing_nms": self.damping_closing,
            "spring_energy_j": self.energy,
        }


def closer_curves(door: Door, theta: ArrayLike) -> CloserCurves:
    """What the closer of a door does at opening angles theta (N,) [rad].

    Raises:
        LinkageError: An angle is beyond the linkage.
    """
    theta = np.atleast_1d(np.asarray(theta, dtype=float))
    door.closer.require_within(theta)
    f, eta = door.closer.f_and_eta(theta)
    return CloserCurves(
        theta=theta,
        f=f,
        eta=eta,
        torque=door.restoring_torque(theta),
        damping_opening=door.viscosity(theta, 1.0) * eta**2,
        damping_closing=door.viscosity(theta, -1.0) * eta**2,
        energy=door.potential_energy(theta),
    )


def round_angles(end: float, step: float) -> Array:
    """The multiples of a step [rad] from 0 on, and the end [rad]."""
    multiples = np.arange(math.ceil(end / step - 1e-9)) * step
    return np.append(multiples, end)


def round_step(end: float, most: int) -> float:
    """The smallest of 1, 2, 5 deg, or these times a power of ten, that fits in so often [rad].

    Args:
        end: Largest angle [rad].
        most: How many steps may lie between 0 and the end.
    """
    least = math.degrees(end) / most * (1.0 - 1e-9)
    decade = 10.0 ** math.floor(math.log10(least))
    return math.radians(next(step * decade for step in (1, 2, 5, 10) if step * decade >= least))


def with_borders(door: Door, theta: Array) -> Array:
    """Rising angles [rad], and those next to each border of a zone between them, both sides.

    Damping jumps there: a line through these points is vertical.
    """
    borders = np.array([zone.angle for zone in (door.backcheck, door.latch) if zone is not None])
    sides = [np.nextafter(borders, -np.inf), borders, np.nextafter(borders, np.inf)]
    near = np.concatenate(sides)
    return np.union1d(theta, near[(near > theta[0]) & (near < theta[-1])])


def largest_shown(closer: FourBarCloser, wanted: float = np.pi / 2.0) -> float:
    """The angle wanted, or where the linkage ends before it a degree less than that [rad].

    Raises:
        LinkageError: The linkage does not close at the closed door.
    """
    return min(wanted, float(closer.opening_limit() - _FROM_THE_END))
