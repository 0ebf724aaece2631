r"""Linkage of the door closer: eqs. (7) to (9) of the paper.

The fixed pivots are a distance `l` apart. Link 1, of length `l_1`, lies on the leaf;
link 2, of length `l_2`, turns with the closer's joint; link 3, of length `l_3`, leads
back to the frame. `D` is the distance between the two pivots that links 2 and 3 connect. The
linkage closes if the sides `D, l_2, l_3` form a triangle. Two such triangles exist, mirrored
about the line of `D`: the assembly modes. Eq. (8) describes one of them.

The paper's appendix prints ``theta_0 = 0.34 rad`` for the angle that eq. (7) calls ``theta_i0``.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.documents import Number, Positive
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from door_model.checks import place, require_within
from door_model.errors import DoorParameterError, LinkageError

LIMIT_MARGIN = 1e-6  # distance kept from the linkage's ends, where eta is infinite [rad]
_LONGEST = 3.0  # link of a closer [m]
_STEPS = 400  # number of steps of the search for dead centres


def four_bar(
    theta: Any, l: Any, l1: Any, l2: Any, l3: Any, theta_i0: Any, assembly: Any  # noqa: E741
) -> tuple[Any, Any, Any]:
    """Evaluate eqs. (7) to (9) and the derivative of eta, without checks.

    Args:
        theta: Opening angles [rad].
        l: Distance between the fixed pivots, as in `FourBarCloser` [m].
        l1: Length of link 1, on the leaf [m].
        l2: Length of link 2 [m].
        l3: Length of link 3 [m].
        theta_i0: Angle at the closed door, as in `FourBarCloser` [rad].
        assembly: Assembly mode, as in `FourBarCloser`.
            All arguments are numbers, or arrays that broadcast.

    Returns:
        f [rad], eta = df/d theta [-] and d eta/d theta [1/rad]; NaN where the linkage does not
        close.
    """
    phi = theta + theta_i0  # eq. (7)
    cosine = np.cos(phi)
    along, across = l * cosine, l * np.sin(phi)
    reach = l1 - along
    d2 = reach * reach + across * across
    d = np.sqrt(d2)
    # The first arccos of eq. (8) is written with arctan2: it has the same value for
    # 0 <= phi <= pi, and is smooth where the arccos has a kink.
    alpha_slope = (l1 * along - l * l) / d2
    d2_slope = 2.0 * l1 * across
    alpha_bend = -(0.5 + alpha_slope) * d2_slope / d2
    # Second arccos: cos(beta) = D (1 + share) / (2 l2) and its derivatives by D^2.
    share = (l2 * l2 - l3 * l3) / d2
    twice = 0.5 / (l2 * d)
    c = twice * d2 * (1.0 + share)
    by_d2 = 0.5 * twice * (1.0 - share)
    sin2 = 1.0 - c * c
    c_slope = by_d2 * d2_slope
    c_bend = by_d2 * (2.0 * l1) * along - twice * (0.25 - 0.75 * share) / d2 * d2_slope * d2_slope
    signed = assembly / np.sqrt(sin2)
    return (
        np.pi - np.arctan2(across, reach) - assembly * np.arccos(c),
        signed * c_slope - alpha_slope,
        signed * (c_bend + c * c_slope * c_slope / sin2) - alpha_bend,
    )


def angle_limits(l: Any, l1: Any, l2: Any, l3: Any, theta_i0: Any) -> tuple[Any, Any]:  # noqa: E741
    """Return the smallest and the largest angle between which a linkage closes [rad].

    The arguments are those of `FourBarCloser`, as numbers or arrays that broadcast. The angles
    enclose the closed door only if the linkage closes there.
    """

    def angle_where(distance: Any) -> Any:
        """Return the angle at which D, which grows with phi in 0 .. pi, reaches a distance."""
        cosine = (l * l + l1 * l1 - distance * distance) / (2.0 * l * l1)
        return np.arccos(np.clip(cosine, -1.0, 1.0)) - theta_i0

    return angle_where(abs(l2 - l3)), angle_where(l2 + l3)


@dataclass(frozen=True)
class FourBarCloser:
    """Four-bar linkage between a leaf and its closer.

    Attributes:
        l: Distance between the fixed pivots of links 1 and 3 [m].
        l1: Length of link 1, on the leaf [m].
        l2: Length of link 2 [m].
        l3: Length of link 3 [m].
        theta_i0: Angle between the fixed part and link 1 at the closed door [rad], 0 to pi.
        assembly: Mode in which links 2 and 3 are assembled: 1 as in eq. (8), -1 mirrored.

    Raises:
        DoorParameterError: A length or the angle is out of its range, or the mode is neither 1 nor
            -1.
    """

    l: Positive  # noqa: E741, the paper's letter
    l1: Positive
    l2: Positive
    l3: Positive
    theta_i0: Number
    assembly: Number = 1.0

    def __post_init__(self) -> None:
        """Check lengths, angle and mode."""
        for name in ("l", "l1", "l2", "l3"):
            require_within(name, getattr(self, name), 0.0, _LONGEST, "m (mm?)")
        require_within("theta_i0", self.theta_i0, 0.0, math.pi, "rad (degrees?)")
        if self.assembly not in (1.0, -1.0):
            raise DoorParameterError("assembly", self.assembly, "1 or -1")

    def f(self, theta: ArrayLike) -> Any:
        """Return the angle of the closer's joint theta_c, eq. (8).

        Args:
            theta: Opening angle(s) [rad], any shape.

        Returns:
            theta_c [rad], in the same shape.

        Raises:
            LinkageError: The linkage does not close at one of the angles.
        """
        return self.f_and_eta(theta)[0]

    def eta(self, theta: ArrayLike) -> Any:
        """Return the reduction ratio eta = d theta_c / d theta, eq. (9), by analytical derivation.

        Args:
            theta: Opening angle(s) [rad], any shape.

        Returns:
            eta [-], in the same shape.

        Raises:
            LinkageError: The linkage does not close at one of the angles.
        """
        return self.f_and_eta(theta)[1]

    def f_and_eta(self, theta: ArrayLike) -> tuple[Any, Any]:
        """Return both `f` and `eta`, which share most of their work."""
        return self.f_eta_slope(theta)[:2]

    def f_eta_slope(self, theta: ArrayLike) -> tuple[Any, Any, Any]:
        """Return `f`, `eta` and d eta / d theta [1/rad], which share most of their work."""
        theta = np.asarray(theta, dtype=float)
        with np.errstate(divide="ignore", invalid="ignore"):
            answer = four_bar(theta, *self.numbers())
        inside = np.isfinite(answer[1])
        if not inside.all():
            self._raise_open(theta, inside)
        return answer

    def numbers(self) -> tuple[float, ...]:
        """Return lengths, angle and mode in the order of `four_bar`."""
        return self.l, self.l1, self.l2, self.l3, self.theta_i0, self.assembly

    def opening_limit(self) -> float:
        """Return the largest opening angle up to which the linkage closes [rad].

        There links 2 and 3 are stretched. If they never are, it is the angle at which link 1 is in
        line with the fixed part (phi = pi), beyond which eq. (8) does not hold.

        Raises:
            LinkageError: The linkage does not close at the closed door.
        """
        self.f(0.0)
        return float(angle_limits(*self.numbers()[:5])[1])

    def closing_limit(self) -> float:
        """Return the smallest angle down to which the linkage closes, which is negative [rad].

        Raises:
            LinkageError: The linkage does not close at the closed door.
        """
        self.f(0.0)
        return float(angle_limits(*self.numbers()[:5])[0])

    def end_link(self, opens: bool) -> str:
        """Return the name of the link that limits the angles when the door opens or closes.

        It is "l1" if link 1 comes into line with the fixed part. Otherwise it is "l2 + l3", if
        these links are stretched, or the longer one of them, if they are folded.
        """
        if opens:
            return "l2 + l3" if self.l2 + self.l3 < self.l + self.l1 else "l1"
        if abs(self.l2 - self.l3) > abs(self.l - self.l1):
            return "l2" if self.l2 > self.l3 else "l3"
        return "l1"

    def require_within(self, theta: ArrayLike) -> None:
        """Check that eq. (8) holds: the links reach, and phi is within 0 .. pi.

        Args:
            theta: Opening angle(s) [rad], any shape.

        Raises:
            LinkageError: Eq. (8) does not hold at one of the angles.
        """
        theta = np.asarray(theta, dtype=float)
        self.f(theta)
        lower, upper = angle_limits(*self.numbers()[:5])
        good = (theta >= lower + LIMIT_MARGIN) & (theta <= upper - LIMIT_MARGIN)
        for number in np.flatnonzero(~good).tolist():
            first = float(theta.flat[number])
            limit = float(upper if first > upper - LIMIT_MARGIN else lower)
            raise LinkageError(
                self.end_link(limit == upper),
                first,
                f"{self.end_link(limit == upper)} limits its range at {math.degrees(limit):.2f} deg"
                f"{place(theta.shape, number)}",
                value=first,
                limit=limit,
            )

    def dead_centre(self) -> float | None:
        """Return the first angle beyond the closed door at which the closer turns round [rad].

        At this angle eta is 0 and link 3 lies in line with the fixed part, so the closer has no
        leverage. Beyond it the spring opens the door, or shuts it in a mode in which it opened it.

        Returns:
            The angle; None if there is none up to the opening limit.

        Raises:
            LinkageError: The linkage does not close at the closed door.
        """
        end = self.opening_limit()
        angles = np.linspace(0.0, end, _STEPS, endpoint=False)
        signs = np.sign(self.eta(angles))
        turns = np.flatnonzero(signs[1:] * signs[0] <= 0.0)
        if not turns.size:
            return None
        low, high = angles[turns[0]], angles[turns[0] + 1]
        return float(brentq(lambda angle: float(self.eta(angle)), low, high))

    def _raise_open(self, theta: NDArray[Any], inside: NDArray[Any]) -> None:
        """Raise the error for the first angle at which the linkage does not close.

        Args:
            theta: Opening angles [rad].
            inside: At which of them the linkage closes.
        """
        number = int(np.argmin(inside))
        first, where = float(theta.flat[number]), place(theta.shape, number)
        if not math.isfinite(first):
            raise DoorParameterError(f"theta{where}", first, "a finite number")
        phi = first + self.theta_i0
        distance = math.hypot(self.l1 - self.l * math.cos(phi), self.l * math.sin(phi))
        longest = self.l2 + self.l3
        if distance >= longest:
            raise LinkageError(
                "l2 + l3",
                first,
                f"l2 + l3 = {longest:.4f} m does not bridge the {distance:.4f} m "
                f"between the pivots{where}",
                value=distance,
                limit=longest,
            )
        shortest = abs(self.l2 - self.l3)
        longer = "l2" if self.l2 > self.l3 else "l3"
        raise LinkageError(
            longer,
            first,
            f"{longer} is too long to fold: |l2 - l3| = {shortest:.4f} m, but the pivots "
            f"are {distance:.4f} m apart{where}",
            value=distance,
            limit=shortest,
        )
