"""Energy balance of a swing: energy in leaf and spring, and heat in damper and hinge."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import NDArray

from door_model.door.door import Door
from door_model.motion.driven_motion import SampledMotion

Index = NDArray[np.int64]
Torque = Callable[[float], float]


@dataclass(frozen=True)
class EnergyBalance:
    """Energies over a swing, each (N,) [J].

    Attributes:
        t: Sample times [s].
        kinetic: Kinetic energy of the leaf.
        spring: Energy of the closer's spring, above that of the closed door.
        damper: Heat in the closer's damper since the first sample.
        friction: Heat by friction at the hinge since the first sample.
        external: Work of the external torque since the first sample.
    """

    t: Array
    kinetic: Array
    spring: Array
    damper: Array
    friction: Array
    external: Array

    @property
    def stored(self) -> Array:
        """Kinetic and spring energy (N,) [J]."""
        return self.kinetic + self.spring

    @property
    def dissipated(self) -> Array:
        """Heat of damper and friction since the first sample (N,) [J]."""
        return self.damper + self.friction

    @property
    def residual(self) -> Array:
        """Error of the balance (N,) [J]: 0 except for the errors of motion and integration."""
        return self.stored + self.dissipated - self.external - self.stored[0]


def energy_balance(door: Door, swing: SampledMotion, torque: Torque | None = None) -> EnergyBalance:
    """Work out the energies over a swing of eq. (1), by eqs. (12) and (13).

    Powers are integrated by Simpson's rule between the samples, in pieces with one direction and
    one zone. The error falls with the fourth power of the time between samples. The energy that the
    leaf loses when it hits its frame is not known here; it appears in the residual.

    Args:
        door: The door.
        swing: Motion of the door, as `dynamics.simulate` returns it.
        torque: External torque that was used in the simulation, over time [N m]; there should be a
            sample wherever it jumps. None means a free door.

    Raises:
        LinkageError: The linkage does not close at an angle of the swing.
    """
    fine = _cut_where_it_turns(door, swing, torque)
    for zone, direction in ((door.backcheck, 1.0), (door.latch, -1.0)):
        if zone is not None:
            fine = _cut_at(door, fine, zone.angle, direction, torque)
    damper, friction, external = _work(door, fine, torque)
    kept = np.searchsorted(fine.t, swing.t)
    return EnergyBalance(
        t=swing.t,
        kinetic=0.5 * door.i_a * swing.omega**2,
        spring=np.asarray(door.potential_energy(swing.theta)),
        damper=damper[kept],
        friction=friction[kept],
        external=external[kept],
    )


def _torques(torque: Torque | None, t: Array) -> Array:
    """Return the external torque at times [N m]."""
    return np.zeros_like(t) if torque is None else np.array([torque(time) for time in t.tolist()])


def _rates(
    door: Door, swing: SampledMotion, places: Index | slice, direction: Array, c_c: Array,
    torque: Torque | None,
) -> Array:
    """Return accelerations (K,) at samples, for given directions and viscosities [rad/s^2]."""
    f, eta = door.closer.f_and_eta(swing.theta[places])
    drag = eta * (c_c * eta * swing.omega[places] + door.k_c * f + door.tau_c0_prime)
    tau = _torques(torque, swing.t[places])
    return np.asarray((tau - drag - direction * door.friction) / door.i_a)


def _with_points(
    swing: SampledMotion, places: Index, after: Array, theta: Array, omega: Array
) -> SampledMotion:
    """Insert a point into a swing at a time `after` [s] each of some samples."""
    t = swing.t[places] + after
    return SampledMotion(*(
        np.insert(old, places + 1, new)
        for old, new in ((swing.t, t), (swing.theta, theta), (swing.omega, omega))))


def _cut_where_it_turns(door: Door, swing: SampledMotion, torque: Torque | None) -> SampledMotion:
    """Insert a point of rest wherever the motion turns round between two samples."""
    places = np.flatnonzero(swing.omega[:-1] * swing.omega[1:] < 0.0)
    theta, omega = swing.theta[places], swing.omega[places]
    direction = np.sign(omega)
    rate = _rates(door, swing, places, direction, door.viscosity(theta, direction), torque)
    with np.errstate(divide="ignore"):
        after = np.clip(-omega / rate, 0.0, np.diff(swing.t)[places])
    return _with_points(swing, places, after, theta + 0.5 * omega * after, np.zeros_like(omega))


def _cut_at(
    door: Door, swing: SampledMotion, border: float, direction: float, torque: Torque | None
) -> SampledMotion:
    """Insert a point on a zone's border wherever the motion enters the zone between samples."""
    away = direction * (border - swing.theta)
    moves = direction * (swing.omega[:-1] + swing.omega[1:]) > 0.0
    places = np.flatnonzero(moves & (away[:-1] > 0.0) & (away[1:] < 0.0))
    theta, before = swing.theta[places], swing.omega[places]
    along = np.full_like(theta, direction)
    rate = _rates(door, swing, places, along, door.viscosity(theta, along), torque)
    distance = border - theta
    omega = direction * np.sqrt(np.maximum(before**2 + 2.0 * rate * distance, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        after = np.nan_to_num(2.0 * distance / (before + omega))
    after = np.clip(after, 0.0, np.diff(swing.t)[places])
    return _with_points(swing, places, after, np.full_like(theta, border), omega)


def _work(door: Door, swing: SampledMotion, torque: Torque | None) -> tuple[Array, Array, Array]:
    """Return the work of damper, friction and external torque up to each sample (N,) [J].

    Direction and zone must not change between two samples.
    """
    t, theta, omega = swing.t, swing.theta, swing.omega
    step, direction = np.diff(t), np.sign(omega[:-1] + omega[1:])
    c_c = door.viscosity(0.5 * (theta[:-1] + theta[1:]), direction)
    start, end = (
        _rates(door, swing, part, direction, c_c, torque) for part in (slice(-1), slice(1, None)))
    # Middle of the cubic through values and slopes at both ends; a door that is held rests.
    between = 0.5 * (theta[:-1] + theta[1:]) + step / 8.0 * (omega[:-1] - omega[1:])
    speed = 0.5 * (omega[:-1] + omega[1:]) + step / 8.0 * (start - end)
    speed = np.where(direction == 0.0, 0.0, speed)

    def integral(at: Array, middle: Array) -> Array:
        """Integrate by Simpson's rule up to each sample."""
        pieces = step / 6.0 * (at[0] + 4.0 * middle + at[1])
        return np.concatenate([[0.0], np.cumsum(pieces)])

    eta, eta_between = door.closer.eta(theta), door.closer.eta(between)
    heat = (eta * omega) ** 2
    tau = _torques(torque, t) * omega
    rubbed = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(theta)))])
    return (
        integral(c_c * np.array([heat[:-1], heat[1:]]), c_c * (eta_between * speed) ** 2),
        door.friction * rubbed,
        integral(np.array([tau[:-1], tau[1:]]), _torques(torque, t[:-1] + 0.5 * step) * speed),
    )
