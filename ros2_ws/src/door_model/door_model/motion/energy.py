"""Where the energy of a swing stays: in leaf and spring, or as heat in damper and hinge."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from door_model.door.door import Door
from door_model.motion.driven_motion import Swing

Array = NDArray[Any]
Torque = Callable[[float], float]


@dataclass(frozen=True)
class EnergyBalance:
    """Energies over a swing, each (N,) [J].

    Attributes:
        t: Times [s].
        kinetic: Of the leaf.
        spring: In the closer's spring, above that of the closed door.
        damper: Turned into heat by the closer's oil since the first sample.
        friction: Turned into heat by the hinge's friction since then.
        external: Work of the external torque since then.
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
        """What the balance misses (N,) [J]: 0 but for the errors of motion and integrals."""
        return self.stored + self.dissipated - self.external - self.stored[0]


def energy_balance(door: Door, swing: Swing, torque: Torque | None = None) -> EnergyBalance:
    """Energies over a swing of eq. (1), by eqs. (12) and (13).

    Powers are integrated by Simpson's rule between the samples, in pieces that keep direction and
    zone. The error falls with the fourth power of their distance. What the leaf loses when it hits
    its frame is not known here: it shows in the residual.

    Args:
        door: The door.
        swing: Its motion, as `dynamics.simulate` gives it.
        torque: The external torque that it was given there [N m]; where it jumps, a sample should
            be; None for a free door.

    Raises:
        LinkageError: The linkage does not close at one of the angles.
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
    """External torque at times [N m]."""
    return np.zeros_like(t) if torque is None else np.array([torque(time) for time in t.tolist()])


def _rates(
    door: Door, swing: Swing, places: Array | slice, direction: Array, c_c: Array,
    torque: Torque | None,
) -> Array:
    """Accelerations (K,) at samples in given directions and with given viscosities [rad/s^2]."""
    f, eta = door.closer.f_and_eta(swing.theta[places])
    drag = eta * (c_c * eta * swing.omega[places] + door.k_c * f + door.tau_c0_prime)
    tau = _torques(torque, swing.t[places])
    return np.asarray((tau - drag - direction * door.friction) / door.i_a)


def _with_points(swing: Swing, places: Array, after: Array, theta: Array, omega: Array) -> Swing:
    """A swing with a further point each, a while [s] after some samples."""
    t = swing.t[places] + after
    return Swing(*(
        np.insert(old, places + 1, new)
        for old, new in ((swing.t, t), (swing.theta, theta), (swing.omega, omega))))


def _cut_where_it_turns(door: Door, swing: Swing, torque: Torque | None) -> Swing:
    """A swing with a point of rest wherever the motion turns round between two samples."""
    places = np.flatnonzero(swing.omega[:-1] * swing.omega[1:] < 0.0)
    theta, omega = swing.theta[places], swing.omega[places]
    direction = np.sign(omega)
    rate = _rates(door, swing, places, direction, door.viscosity(theta, direction), torque)
    with np.errstate(divide="ignore"):
        after = np.clip(-omega / rate, 0.0, np.diff(swing.t)[places])
    return _with_points(swing, places, after, theta + 0.5 * omega * after, np.zeros_like(omega))


def _cut_at(
    door: Door, swing: Swing, border: float, direction: float, torque: Torque | None
) -> Swing:
    """A swing with a point on the border of a zone wherever it enters that between two samples."""
    away = direction * (border - swing.theta)
    moves = direction * (swing.omega[:-1] + swing.omega[1:]) > 0.0
    places = np.flatnonzero(moves & (away[:-1] > 0.0) & (away[1:] < 0.0))
    theta, before = swing.theta[places], swing.omega[places]
    along = np.full_like(theta, direction)
    rate = _rates(door, swing, places, along, door.viscosity(theta, along), torque)
    way = border - theta
    omega = direction * np.sqrt(np.maximum(before**2 + 2.0 * rate * way, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        after = np.nan_to_num(2.0 * way / (before + omega))
    after = np.clip(after, 0.0, np.diff(swing.t)[places])
    return _with_points(swing, places, after, np.full_like(theta, border), omega)


def _work(door: Door, swing: Swing, torque: Torque | None) -> tuple[Array, Array, Array]:
    """Work of damper, friction and external torque up to each sample (N,) [J].

    Between two samples the motion keeps direction and zone.
    """
    t, theta, omega = swing.t, swing.theta, swing.omega
    step, direction = np.diff(t), np.sign(omega[:-1] + omega[1:])
    c_c = door.viscosity(0.5 * (theta[:-1] + theta[1:]), direction)
    start, end = (
        _rates(door, swing, part, direction, c_c, torque) for part in (slice(-1), slice(1, None)))
    # Middles of the cubics that fit values and slopes at both ends; a door held stays at rest.
    between = 0.5 * (theta[:-1] + theta[1:]) + step / 8.0 * (omega[:-1] - omega[1:])
    speed = 0.5 * (omega[:-1] + omega[1:]) + step / 8.0 * (start - end)
    speed = np.where(direction == 0.0, 0.0, speed)

    def integral(at: Array, middle: Array) -> Array:
        """Simpson's rule, summed up."""
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
