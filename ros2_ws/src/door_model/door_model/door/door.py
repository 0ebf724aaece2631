"""A swing door with its closer: eqs. (1), (12) and (13) of the paper, and what real closers add.

Eq. (12)'s ``tau'_c0`` is ``tau_c0 - k_c theta_c0`` (the paper prints ``theta_0``), so that the
closer's torque is ``k_c f(theta) + tau'_c0``. ``c_c`` is in N m s/rad.

Beyond the paper, each off by default: the viscosity of closing (its Fig. 14 shows that it is not
that of opening; closers let their oil through a valve one way), a backcheck, a latch zone
(EN 1154 and closer makers' terms) and Coulomb friction at the hinge.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from door_model.checks import require_finite, require_not_negative, require_positive
from door_model.door.closer import FourBarCloser
from door_model.door.ratios import Ratios


@dataclass(frozen=True)
class Zone:
    """Angles in which a closer damps otherwise.

    Attributes:
        angle: Where the zone begins [rad]: a backcheck lies above it, a latch zone below.
        c_c: Viscosity at the closer's joint there [N m s/rad].

    Raises:
        DoorParameterError: The angle is no number or the viscosity is negative.
    """

    angle: float
    c_c: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_finite("angle of a zone", self.angle)
        require_not_negative("c_c of a zone", self.c_c)


@dataclass(frozen=True)
class Door:
    """A leaf on a hinge with a closer, eq. (1).

    Attributes:
        i_a: Moment of inertia of the leaf about its hinge [kg m^2] (the paper's text calls it
            an angular momentum).
        c_c: Viscosity at the closer's joint [N m s/rad].
        k_c: Spring coefficient at the closer's joint [N m/rad].
        tau_c0_prime: Closer torque of eq. (12), extrapolated to theta_c = 0 [N m].
        closer: The linkage.
        c_c_closing: Viscosity while the door closes [N m s/rad]; None: as while it opens.
        backcheck: Where opening is damped otherwise; None: nowhere.
        latch: Where closing is damped otherwise; None: nowhere.
        friction: Coulomb friction at the hinge [N m].

    Raises:
        DoorParameterError: i_a is not positive, c_c, k_c or the friction is negative, or one is
            no number.
    """

    i_a: float
    c_c: float
    k_c: float
    tau_c0_prime: float
    closer: FourBarCloser
    c_c_closing: float | None = None
    backcheck: Zone | None = None
    latch: Zone | None = None
    friction: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_positive("i_a", self.i_a)
        for name in ("c_c", "k_c", "friction"):
            require_not_negative(name, getattr(self, name))
        require_finite("tau_c0_prime", self.tau_c0_prime)
        if self.c_c_closing is not None:
            require_not_negative("c_c_closing", self.c_c_closing)

    def restoring_torque(self, theta: ArrayLike) -> Any:
        """Torque that shuts the door, eq. (12) [N m], for angle(s) theta [rad]."""
        f, eta = self.closer.f_and_eta(theta)
        return eta * (self.k_c * f + self.tau_c0_prime)

    def dead_centre(self) -> float | None:
        """Angle from which on the spring opens the door that it shut until there [rad].

        Returns:
            The linkage's dead centre; None where it has none, or its spring opens the door before.

        Raises:
            LinkageError: The linkage does not close at the closed door.
        """
        angle = self.closer.dead_centre()
        if angle is None:
            return None
        # eta keeps its sign up to there, and falls to 0 there: the torque's sign needs both.
        shuts = self.closer.eta(0.0) * (self.k_c * self.closer.f(angle) + self.tau_c0_prime) > 0.0
        return angle if shuts else None

    @property
    def closing_viscosity(self) -> float:
        """Viscosity while the door closes, outside the latch zone [N m s/rad]."""
        return self.c_c if self.c_c_closing is None else self.c_c_closing

    def viscosity(self, theta: ArrayLike, omega: ArrayLike) -> Any:
        """Viscosity that acts [N m s/rad], at angle(s) [rad] and velocity [rad/s]."""
        theta, omega = np.asarray(theta, dtype=float), np.asarray(omega, dtype=float)
        c_c = np.where(omega > 0.0, self.c_c, self.closing_viscosity)
        if self.backcheck is not None:
            c_c = np.where((omega > 0.0) & (theta >= self.backcheck.angle), self.backcheck.c_c, c_c)
        if self.latch is not None:
            c_c = np.where((omega <= 0.0) & (theta <= self.latch.angle), self.latch.c_c, c_c)
        return c_c[()]

    def damping_torque(self, theta: ArrayLike, omega: ArrayLike) -> Any:
        """Torque against the motion, eq. (13) [N m], at angle(s) [rad] and velocity [rad/s]."""
        omega = np.asarray(omega, dtype=float)
        return self.viscosity(theta, omega) * self.closer.eta(theta) ** 2 * omega

    def friction_torque(self, omega: ArrayLike) -> Any:
        """Torque of the hinge's friction against the motion [N m], at velocities [rad/s]."""
        return self.friction * np.sign(omega)

    def acceleration(self, theta: ArrayLike, omega: ArrayLike, tau_ext: ArrayLike = 0.0) -> Any:
        """Angular acceleration by eq. (1) [rad/s^2].

        Args:
            theta: Opening angle(s) [rad].
            omega: Angular velocity [rad/s].
            tau_ext: External torque about the hinge, positive when it opens [N m].

        Raises:
            LinkageError: The linkage does not close at one of the angles.
        """
        torque = self.restoring_torque(theta) + self.damping_torque(theta, omega)
        torque = torque + self.friction_torque(omega)
        return (np.asarray(tau_ext, dtype=float) - torque) / self.i_a

    def potential_energy(self, theta: ArrayLike) -> Any:
        """Energy in the spring above that of the closed door [J], for angle(s) theta [rad].

        Eq. (12) integrated, since eta is the slope of f.
        """
        f, shut = self.closer.f(theta), self.closer.f(0.0)
        return (f - shut) * (0.5 * self.k_c * (f + shut) + self.tau_c0_prime)

    def energy(self, theta: ArrayLike, omega: ArrayLike) -> Any:
        """Kinetic and spring energy [J]."""
        kinetic = 0.5 * self.i_a * np.asarray(omega, dtype=float) ** 2
        return kinetic + self.potential_energy(theta)

    def power_lost(self, theta: ArrayLike, omega: ArrayLike) -> Any:
        """Power that damper and friction turn into heat [W]."""
        against = self.damping_torque(theta, omega) + self.friction_torque(omega)
        return against * np.asarray(omega, dtype=float)

    def ratios(self) -> Ratios:
        """The parameters over I_A, on which free motion depends alone."""
        closing = self.closing_viscosity
        return Ratios(
            opening=self.c_c / self.i_a,
            closing=closing / self.i_a,
            backcheck=(self.c_c if self.backcheck is None else self.backcheck.c_c) / self.i_a,
            latch=(closing if self.latch is None else self.latch.c_c) / self.i_a,
            spring=self.k_c / self.i_a,
            preload=self.tau_c0_prime / self.i_a,
            friction=self.friction / self.i_a,
            backcheck_angle=np.inf if self.backcheck is None else self.backcheck.angle,
            latch_angle=-np.inf if self.latch is None else self.latch.angle,
        )
