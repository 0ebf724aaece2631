r"""Linkage of the door closer: eqs. (7) to (9) of the paper.

The fixed pivots are a distance :math:`l` apart. Link 1 lies on the leaf, link 2 on the closer's
joint, link 3 returns to the frame. :math:`D` is the distance between the two pivots that links 2
and 3 join; the linkage closes while the triangle :math:`(D, l_2, l_3)` does.

The paper's appendix prints ``theta_0 = 0.34 rad`` for what eq. (7) calls ``theta_i0``.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from door_model.checks import require_finite, require_positive
from door_model.errors import DoorParameterError, LinkageError


@dataclass(frozen=True, kw_only=False)
class FourBarCloser:
    """Four-bar linkage between a leaf and its closer.

    Attributes:
        l: Distance between the fixed pivots of links 1 and 3 [m].
        l1: Link 1, on the leaf [m].
        l2: Link 2 [m].
        l3: Link 3 [m].
        theta_i0: Angle between the fixed part and link 1 at the closed door [rad], 0 to pi.

    Raises:
        DoorParameterError: A length is not positive or the angle is not between 0 and pi.
    """

    l: float  # noqa: E741, the paper's letter
    l1: float
    l2: float
    l3: float
    theta_i0: float

    def __post_init__(self) -> None:
        """Check lengths and angle."""
        for name in ("l", "l1", "l2", "l3"):
            require_positive(name, getattr(self, name))
        require_finite("theta_i0", self.theta_i0)
        if not 0.0 < self.theta_i0 < math.pi:
            raise DoorParameterError("theta_i0", self.theta_i0, "between 0 and pi")

    def f(self, theta: ArrayLike) -> Any:
        """Angle of the closer's joint theta_c, eq. (8).

        Args:
            theta: Opening angle(s) [rad], any shape.

        Returns:
            theta_c [rad], same shape.

        Raises:
            LinkageError: The linkage does not close at one of the angles.
        """
        return self.f_and_eta(theta)[0]

    def eta(self, theta: ArrayLike) -> Any:
        """Reduction ratio d theta_c / d theta, eq. (9), by differentiating eq. (8) on paper.

        Args:
            theta: Opening angle(s) [rad], any shape.

        Returns:
            eta [-], same shape.

        Raises:
            LinkageError: The linkage does not close at one of the angles.
        """
        return self.f_and_eta(theta)[1]

    def f_and_eta(self, theta: ArrayLike) -> tuple[Any, Any]:
        """Both f and eta, which share most of their work; see there."""
        phi = np.asarray(theta, dtype=float) + self.theta_i0  # eq. (7)
        cos_phi = np.cos(phi)
        sin_phi = np.sin(phi)
        d2 = self.l**2 + self.l1**2 - 2.0 * self.l1 * self.l * cos_phi
        d = np.sqrt(d2)
        difference = self.l2**2 - self.l3**2
        with np.errstate(divide="ignore", invalid="ignore"):
            cos_beta = (d2 + difference) / (2.0 * self.l2 * d)
            inside = np.abs(cos_beta) < 1.0
        if not inside.all():
            self._raise_open(phi, d, inside)
        # First arccos of eq. (8), written with arctan2: same value for 0 <= phi <= pi, and smooth
        # where the arccos would fold.
        alpha = np.arctan2(self.l * sin_phi, self.l1 - self.l * cos_phi)
        alpha_slope = self.l * (self.l1 * cos_phi - self.l) / d2
        cos_beta_slope = (
            (1.0 - difference / d2) * (self.l * self.l1 * sin_phi / d) / (2.0 * self.l2)
        )
        beta_slope = -cos_beta_slope / np.sqrt(1.0 - cos_beta**2)
        return np.pi - alpha - np.arccos(cos_beta), -alpha_slope - beta_slope

    def opening_limit(self) -> float:
        """Largest opening angle up to which the linkage closes, from the closed door on [rad].

        It ends where links 2 and 3 are stretched, or, if they never are, where link 1 is in line
        with the fixed part (phi = pi), beyond which eq. (8) no longer holds.

        Raises:
            LinkageError: The linkage does not even close at the closed door.
        """
        self.f(0.0)
        return self._angle_where(self.l2 + self.l3) - self.theta_i0

    def closing_limit(self) -> float:
        """Smallest angle (negative) down to which the linkage closes [rad].

        Raises:
            LinkageError: The linkage does not even close at the closed door.
        """
        self.f(0.0)
        return self._angle_where(abs(self.l2 - self.l3)) - self.theta_i0

    def _angle_where(self, distance: float) -> float:
        """Angle phi in 0 .. pi at which D reaches a distance; D grows with phi."""
        cos_phi = (self.l**2 + self.l1**2 - distance**2) / (2.0 * self.l * self.l1)
        return math.acos(min(1.0, max(-1.0, cos_phi)))

    def _raise_open(self, phi: NDArray[Any], d: NDArray[Any], inside: NDArray[Any]) -> None:
        """Name the link and the angle of the first point at which the linkage does not close."""
        first = int(np.argmin(np.ravel(inside)))
        theta = float(np.ravel(phi)[first]) - self.theta_i0
        distance = float(np.ravel(d)[first])
        if not math.isfinite(theta):
            raise DoorParameterError("theta", theta, "a finite number")
        longest = self.l2 + self.l3
        if distance >= longest:
            raise LinkageError(
                "l2 + l3",
                theta,
                f"l2 + l3 = {longest:.4f} m does not bridge the {distance:.4f} m "
                "between the pivots",
                value=distance,
                limit=longest,
            )
        shortest = abs(self.l2 - self.l3)
        longer = "l2" if self.l2 > self.l3 else "l3"
        raise LinkageError(
            longer,
            theta,
            f"{longer} is too long to fold: |l2 - l3| = {shortest:.4f} m, but the pivots "
            f"are {distance:.4f} m apart",
            value=distance,
            limit=shortest,
        )
