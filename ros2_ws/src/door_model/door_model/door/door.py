"""A swing door with its closer: eqs. (1), (12) and (13) of the paper, and extensions of them.

In eq. (12) ``tau'_c0`` is ``tau_c0 - k_c theta_c0`` (the paper prints ``theta_0``), so the closer's
torque is ``k_c f(theta) + tau'_c0``. The unit of ``c_c`` is N m s/rad.

The model has extensions that real closers need; each is off by default. Closing may have another
viscosity than opening, as the paper's Fig. 14 shows, because the oil of a closer flows through a
valve in one direction. There may be a backcheck, a latch zone (terms of EN 1154 and of makers of
closers), and Coulomb friction at the hinge.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.documents import NotNegative
from numpy.typing import ArrayLike

from door_model.checks import (
    require_finite,
    require_not_negative,
    require_positive,
    require_within,
)
from door_model.door.closer import FourBarCloser
from door_model.door.ratios import Ratios


@dataclass(frozen=True)
class Zone:
    """Range of angles in which a closer has another viscosity.

    Attributes:
        angle: Border of the zone [rad]; a backcheck lies above it, a latch zone below it.
        c_c: Viscosity at the closer's joint in the zone [N m s/rad].

    Raises:
        DoorParameterError: The angle is negative or above pi, or the viscosity is negative.
    """

    angle: NotNegative
    c_c: NotNegative

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_within("angle of a zone", self.angle, 0.0, math.pi, "rad (degrees?)", least=True)
        require_not_negative("c_c of a zone", self.c_c)


@dataclass(frozen=True)
class Door:
    """A leaf on a hinge with a closer, eq. (1).

    Attributes:
        i_a: Moment of inertia of the leaf about its hinge [kg m^2] (the paper's text calls it
            an angular momentum).
        c_c: Viscosity at the closer's joint while the door opens [N m s/rad].
        k_c: Spring coefficient at the closer's joint [N m/rad].
        tau_c0_prime: Closer torque of eq. (12), extrapolated to theta_c = 0 [N m].
        closer: The linkage.
        c_c_closing: Viscosity while the door closes [N m s/rad]; None means that it is c_c.
        backcheck: Zone in which opening has another viscosity; None means that there is none.
        latch: Zone in which closing has another viscosity; None means that there is none.
        friction: Coulomb friction at the hinge [N m].

    Raises:
        DoorParameterError: i_a is not positive, a viscosity, k_c or the friction is negative, or a
            value is not a finite number.
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
        """Return the torque [N m] that shuts the door at angle(s) theta [rad], eq. (12)."""
        f, eta = self.closer.f_and_eta(theta)
        return eta * (self.k_c * f + self.tau_c0_prime)

    def dead_centre(self) -> float | None:
        """Return the angle beyond which the spring opens the door, which it shuts below [rad].

        Returns:
            The linkage's dead centre; None if there is none, or if the spring opens the door
            already below it.

        Raises:
            LinkageError: The linkage does not close at the closed door.
        """
        angle = self.closer.dead_centre()
        if angle is None:
            return None
        # Up to the dead centre eta keeps its sign; the other factor of the torque is taken at it.
        shuts = self.closer.eta(0.0) * (self.k_c * self.closer.f(angle) + self.tau_c0_prime) > 0.0
        return angle if shuts else None

    @property
    def closing_viscosity(self) -> float:
        """Viscosity while the door closes, outside the latch zone [N m s/rad]."""
        return self.c_c if self.c_c_closing is None else self.c_c_closing

    def viscosity(self, theta: ArrayLike, omega: ArrayLike) -> Any:
        """Return the viscosity [N m s/rad] that acts at angle(s) [rad] and velocity [rad/s]."""
        theta, omega = np.asarray(theta, dtype=float), np.asarray(omega, dtype=float)
        c_c = np.where(omega > 0.0, self.c_c, self.closing_viscosity)
        if self.backcheck is not None:
            c_c = np.where((omega > 0.0) & (theta >= self.backcheck.angle), self.backcheck.c_c, c_c)
        if self.latch is not None:
            c_c = np.where((omega <= 0.0) & (theta <= self.latch.angle), self.latch.c_c, c_c)
        return c_c[()]

    def damping_torque(self, theta: ArrayLike, omega: ArrayLike) -> Any:
        """Return the damping torque [N m] at angle(s) [rad] and velocity [rad/s], eq. (13)."""
        omega = np.asarray(omega, dtype=float)
        return self.viscosity(theta, omega) * self.closer.eta(theta) ** 2 * omega

    def acceleration(self, theta: ArrayLike, omega: ArrayLike, tau_ext: ArrayLike = 0.0) -> Any:
        """Return the angular acceleration by eq. (1) [rad/s^2].

        Args:
            theta: Opening angle(s) [rad].
            omega: Angular velocity [rad/s].
            tau_ext: External torque about the hinge, positive when it opens [N m].

        Raises:
            LinkageError: The linkage does not close at one of the angles.
        """
        torque = self.restoring_torque(theta) + self.damping_torque(theta, omega)
        torque = torque + self.friction * np.sign(omega)
        return (np.asarray(tau_ext, dtype=float) - torque) / self.i_a

    def ratios(self) -> Ratios:
        """Return the parameters divided by I_A, on which free motion depends."""
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
