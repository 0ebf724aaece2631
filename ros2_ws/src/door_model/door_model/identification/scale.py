"""What fixes the scale of an identification, which free motion leaves open.

With no external torque, one factor on I_A, c_c, k_c and tau'_c0 leaves eq. (1)'s motion as it is.
One measurement more gives the factor: the moment of inertia itself, the leaf's mass and width, the
force that holds the door open, or an impulse that is known.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from door_impact_common.arrays import Array
from scipy.integrate import trapezoid

from door_model.checks import require_not_negative, require_positive
from door_model.door.closer import FourBarCloser
from door_model.door.geometry import plate_moment_of_inertia
from door_model.errors import DoorParameterError, NoScaleError
from door_model.recording.recording import Recording
from door_model.recording.swings import FreeSwing, smooth

MASS_STD_SHARE = 0.005  # a balance's, over the mass
WIDTH_STD = 1e-3  # a ruler's [m]
FORCE_STD = 0.5  # a hand-held gauge's [N]
LEVER_STD = 2e-3  # of where it is held [m]
_PLAUSIBLE = {"mass": (0.1, 5000.0), "width": (0.05, 10.0)}  # [kg], [m]
_LARGEST_INERTIA = 1e5  # [kg m^2]
_LARGEST_FORCE = 1e4  # [N]
_LARGEST_IMPULSE = 1e4  # [N m s]
_LONGEST_LEVER = 3.0  # [m]
_APART = 9.0  # squared standard deviations that readings may differ by
_MOVED = 3.0  # counts that a shut door may show


@dataclass(frozen=True)
class Scale:
    """Moment of inertia of the leaf with its standard deviation.

    Attributes:
        i_a: Moment of inertia about the hinge [kg m^2].
        std: Its standard deviation [kg m^2], by the measurement alone.
        reference: What it comes from, in words.
        by_ratios: Its derivatives by c_c, k_c and tau'_c0 over I_A, as fitted (3,).
        doubts: What to know before it is trusted.
    """

    i_a: float
    std: float
    reference: str
    by_ratios: Array = field(default_factory=lambda: np.zeros(3))
    doubts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_positive("i_a", self.i_a)
        require_not_negative("std of i_a", self.std)

    def resolve(self, _: "Fitted") -> "Scale":
        """Itself: it needs no fit."""
        return self


@dataclass(frozen=True)
class Fitted:
    """What a reference may need of the fit.

    Attributes:
        linkage: The closer's linkage.
        ratios: (3,) c_c (opening), k_c and tau'_c0 over I_A.
        recording: The recording.
        swings: The free swings in it.
        play: Between the leaf and its encoder [rad].
        zero: What the encoder shows at the closed door [rad].
    """

    linkage: FourBarCloser
    ratios: Array
    recording: Recording
    swings: Sequence[FreeSwing]
    play: float = 0.0
    zero: float = 0.0


class Reference(Protocol):
    """A measurement that fixes the scale."""

    def resolve(self, fitted: Fitted) -> Scale:
        """The scale by this measurement and the fitted ratios.

        Raises:
            NoScaleError: The two do not fit together.
        """


@dataclass(frozen=True)
class ForceReading:
    """A force gauge that holds the door still, at a right angle to the leaf.

    Attributes:
        angle: Opening angle [rad].
        force: Force [N].
        lever: From the hinge to where it acts [m].
        force_std: Standard deviation of the force [N].
        lever_std: Of the lever [m].

    Raises:
        DoorParameterError: Force, lever or their spread is not positive, the lever is no lever.
    """

    angle: float
    force: float
    lever: float
    force_std: float = FORCE_STD
    lever_std: float = LEVER_STD

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("force", "lever", "force_std"):
            require_positive(name, getattr(self, name))
        require_not_negative("lever_std", self.lever_std)
        if self.force > _LARGEST_FORCE:
            raise DoorParameterError("force", self.force, f"up to {_LARGEST_FORCE:g} N")
        if self.lever > _LONGEST_LEVER:
            raise DoorParameterError("lever", self.lever, f"in metres, up to {_LONGEST_LEVER:g}")

    @property
    def torque(self) -> float:
        """About the hinge [N m]."""
        return self.force * self.lever

    @property
    def torque_std(self) -> float:
        """Standard deviation of the torque [N m]."""
        return math.hypot(self.lever * self.force_std, self.force * self.lever_std)


@dataclass(frozen=True)
class ForceGauge:
    """Readings of a force gauge, of which each gives the restoring torque, eq. (12).

    Attributes:
        readings: One or more. Friction at the hinge is to be kept out of them: read while the
            door creeps open and while it creeps shut, and give the means.
    """

    readings: Sequence[ForceReading]

    def resolve(self, fitted: Fitted) -> Scale:
        """I_A by weighted least squares of the torques over the fitted torque a unit of I_A.

        Raises:
            NoScaleError: No reading, or the fitted closer does not pull at their angles.
            LinkageError: The linkage does not close at an angle.
        """
        if not self.readings:
            raise NoScaleError("no reading of the force gauge", value=0, limit=1)
        angles = np.array([row.angle for row in self.readings])
        fitted.linkage.require_within(angles)
        f, eta = fitted.linkage.f_and_eta(angles)
        slopes = np.column_stack([np.zeros(len(f)), eta * f, eta])
        pull = slopes @ fitted.ratios
        if not (pull > 0.0).all():
            raise NoScaleError(
                "the fitted closer does not pull at the angle of a reading, "
                f"{math.degrees(self.readings[int(np.argmin(pull))].angle):.1f} deg",
                value=float(pull.min()),
                limit=0.0,
            )
        torque = np.array([row.torque for row in self.readings])
        weight = np.array([row.torque_std for row in self.readings]) ** -2.0
        information = float(weight @ pull**2)
        i_a = float(weight @ (torque * pull)) / information
        by_pull = weight * (torque - 2.0 * i_a * pull) / information
        # Readings that scatter more than they should widen the answer.
        excess = float(weight @ (torque - i_a * pull) ** 2) / max(1, len(torque) - 1)
        std = math.sqrt(max(1.0, excess) / information)
        doubts = () if excess < _APART else (
            "the readings of the force gauge contradict each other by "
            f"{math.sqrt(excess):.1f} times their standard deviations",)
        plural = "" if len(torque) == 1 else "s"
        return Scale(
            i_a, std, f"{len(torque)} reading{plural} of a force gauge", by_pull @ slopes, doubts)


@dataclass(frozen=True)
class KnownImpulse:
    """A push whose angular impulse about the hinge was measured, as by a force gauge that records.

    Attributes:
        impulse: Time integral of force times lever while the leaf moved [N m s].
        std: Its standard deviation [N m s].
        swing: Which free swing of the recording it led to; the first is 1.

    Raises:
        DoorParameterError: The impulse is not positive or its spread is negative.
    """

    impulse: float
    std: float
    swing: int = 1

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_positive("impulse", self.impulse)
        require_not_negative("std of impulse", self.std)
        if self.impulse > _LARGEST_IMPULSE:
            raise DoorParameterError("impulse", self.impulse, f"up to {_LARGEST_IMPULSE:g} N m s")
        if not (math.isfinite(self.swing) and self.swing == int(self.swing)):
            raise DoorParameterError("the swing of the impulse", self.swing, "a whole number")

    def resolve(self, fitted: Fitted) -> Scale:
        """I_A by eq. (1) integrated from rest to the free motion's start.

        J = I_A (w + integral of the closer's torque a unit of I_A over the push).

        Raises:
            NoScaleError: There is no such swing, or it did not begin from rest.
        """
        if not 1 <= self.swing <= len(fitted.swings):
            raise NoScaleError(
                f"the impulse is of swing {self.swing}, there are {len(fitted.swings)}",
                value=self.swing,
                limit=len(fitted.swings),
            )
        swing, recording = fitted.swings[int(self.swing) - 1], fitted.recording
        period = float(np.median(np.diff(recording.t)))
        end = int(np.searchsorted(recording.t, swing.t[0]))
        theta = np.maximum(recording.theta - fitted.zero, 0.0)
        still = np.flatnonzero(theta[:end] <= _MOVED * recording.resolution)
        if not still.size:
            raise NoScaleError(
                f"the recording begins amid the push of swing {self.swing}: the door must be seen "
                "shut before", value=float(theta[0]), limit=0.0)
        moved = int(still[-1]) + 1
        push = slice(moved, end + 1)
        speed = smooth(theta[: end + round(0.1 / period)], period, 1)
        leaf = theta + max(fitted.play, 0.0)  # it moves before its encoder does
        f, eta = fitted.linkage.f_and_eta(leaf[push])
        slopes = trapezoid(
            np.column_stack([eta**2 * speed[push], eta * f, eta]), recording.t[push], axis=0)
        # Before it was seen to move it had moved for theta / omega (a blow) to three times as long
        # (a torque that rises steadily).
        delay = leaf[moved] / max(float(speed[moved]), 1e-6)
        shut = np.array([0.0, eta[0] * f[0], eta[0]])
        slopes += 2.0 * delay * shut
        total = float(speed[end] + slopes @ fitted.ratios)
        i_a = self.impulse / total
        doubt = i_a * delay * float(shut @ fitted.ratios)
        return Scale(
            i_a, math.hypot(self.std, doubt) / total,
            f"a known impulse of {self.impulse:g} N m s", -i_a / total * slopes)


def scale_from_inertia(i_a: float, std: float) -> Scale:
    """Scale from a known moment of inertia, as of a drawing or a pendulum test.

    Args:
        i_a: About the hinge [kg m^2].
        std: Its standard deviation [kg m^2].

    Raises:
        NoScaleError: One is no number or out of its range.
    """
    if not (0.0 < i_a <= _LARGEST_INERTIA and 0.0 <= std <= _LARGEST_INERTIA):
        raise NoScaleError(
            f"a moment of inertia of {i_a} +- {std} kg m^2 fixes no scale",
            value=(i_a, std),
            limit=f"positive numbers up to {_LARGEST_INERTIA:g}",
        )
    return Scale(i_a, std, f"I_A of {i_a:g} kg m^2 as given")


def scale_from_leaf(
    mass: float | None,
    width: float | None,
    *,
    mass_std: float | None = None,
    width_std: float = WIDTH_STD,
) -> Scale:
    """Scale from the leaf's mass and width, I_A = m w^2 / 3.

    Args:
        mass: Mass [kg].
        width: Hinge to free edge [m].
        mass_std: Standard deviation of the mass [kg]; 0.5 % by default.
        width_std: Standard deviation of the width [m].

    Raises:
        NoScaleError: One is missing, not finite or not positive.
    """
    for name, value in (("mass", mass), ("width", width)):
        if value is None or not (math.isfinite(value) and value > 0.0):
            raise NoScaleError(
                f"the leaf's {name} is {'missing' if value is None else value}: free swings fix "
                "only the ratios of I_A, c_c, k_c and tau'_c0, so weigh the leaf [kg] and "
                "measure its width [m] from hinge to free edge, or read the force that holds the "
                "door open",
                value=value,
                limit="a positive number",
            )
        low, high = _PLAUSIBLE[name]
        if not low <= value <= high:
            raise NoScaleError(
                f"the leaf's {name} of {value:g} is not plausible: {low:g} to {high:g}",
                value=value,
                limit=(low, high),
            )
    assert mass is not None
    assert width is not None
    mass_share = MASS_STD_SHARE if mass_std is None else mass_std / mass
    i_a = plate_moment_of_inertia(mass, width)
    std = i_a * math.hypot(mass_share, 2.0 * width_std / width)
    return Scale(i_a, std, f"I_A = m w^2 / 3 from a leaf of {mass:g} kg and {width:g} m")
