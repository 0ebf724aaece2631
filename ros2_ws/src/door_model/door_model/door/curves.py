"""Curves of a closer over the opening angle: the data of the paper's Figs. 15 and 16."""

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

from door_model.door.closer import FourBarCloser
from door_model.door.door import Door

_FROM_THE_END = np.radians(1.0)  # distance kept from the linkage's end: eta is infinite there [rad]


@dataclass(frozen=True)
class CloserCurves:
    """Properties of a closer at N opening angles, each (N,).

    Attributes:
        theta: Opening angles [rad].
        f: Angle of the closer's joint, eq. (8) [rad].
        eta: Reduction ratio, eq. (9) [-].
        torque: Restoring torque, eq. (12) [N m].
        damping_opening: Damping about the hinge c_c eta^2, eq. (13), while the door opens
            [N m s/rad].
        damping_closing: Damping about the hinge while the door closes [N m s/rad].
        energy: Energy of the spring above that of the closed door [J].
    """

    theta: Array
    f: Array
    eta: Array
    torque: Array
    damping_opening: Array
    damping_closing: Array
    energy: Array

    def columns(self) -> dict[str, Array]:
        """Return the curves by name with unit; angles are in degrees."""
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
    """Work out the curves of a door's closer at opening angles theta (N,) [rad].

    Raises:
        LinkageError: The linkage does not close at one of the angles.
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
    """Return the multiples of a step [rad] from 0 up to the end [rad], and the end."""
    multiples = np.arange(math.ceil(end / step - 1e-9)) * step
    return np.append(multiples, end)


def round_step(end: float, most: int) -> float:
    """Return the smallest step of 1, 2 or 5 deg times a power of ten that is coarse enough [rad].

    Args:
        end: Largest angle [rad].
        most: Largest number of steps between 0 and the end.
    """
    least = math.degrees(end) / most * (1.0 - 1e-9)
    decade = 10.0 ** math.floor(math.log10(least))
    return math.radians(next(step * decade for step in (1, 2, 5, 10) if step * decade >= least))


def with_borders(door: Door, theta: Array) -> Array:
    """Add angles on both sides of each border of a zone to increasing angles [rad].

    The damping jumps at a border, and a line through these points is vertical.
    """
    borders = np.array([zone.angle for zone in (door.backcheck, door.latch) if zone is not None])
    sides = [np.nextafter(borders, -np.inf), borders, np.nextafter(borders, np.inf)]
    near = np.concatenate(sides)
    return np.union1d(theta, near[(near > theta[0]) & (near < theta[-1])])


def largest_shown(closer: FourBarCloser, wanted: float = np.pi / 2.0) -> float:
    """Return the wanted angle, or one degree less than the linkage's end if that is smaller [rad].

    Raises:
        LinkageError: The linkage does not close at the closed door.
    """
    return min(wanted, float(closer.opening_limit() - _FROM_THE_END))
