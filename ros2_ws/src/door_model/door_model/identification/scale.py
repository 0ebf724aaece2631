"""Measurements that fix the scale of an identification, which free motion leaves open.

Without an external torque, a common factor of I_A, c_c, k_c and tau'_c0 does not change the motion
of eq. (1). A further measurement gives this factor: the moment of inertia itself, the leaf's mass
and width, the force that holds the door open, or a known impulse.
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

MASS_STD_SHARE = 0.005  # standard deviation of a balance / mass
WIDTH_STD = 1e-3  # standard deviation of a width measured with a ruler [m]
FORCE_STD = 0.5  # standard deviation of a hand-held force gauge [N]
LEVER_STD = 2e-3  # standard deviation of the place where the gauge is held [m]
_PLAUSIBLE = {"mass": (0.1, 5000.0), "width": (0.05, 10.0)}  # plausible ranges [kg], [m]
_LARGEST_INERTIA = 1e5  # largest accepted moment of inertia [kg m^2]
_LARGEST_FORCE = 1e4  # largest accepted force [N]
_LARGEST_IMPULSE = 1e4  # largest accepted angular impulse [N m s]
_LONGEST_LEVER = 3.0  # longest accepted lever [m]
_APART = 9.0  # readings contradict each other if their variance is larger by this factor
_RADIANS = 1.6  # angles below this number are probably in radians [deg]
_MOVED = 3.0  # largest angle of a shut door [counts]


@dataclass(frozen=True)
class Scale:
    """Moment of inertia of the leaf, which is the scale, with its standard deviation.

    Attributes:
        i_a: Moment of inertia about the hinge [kg m^2].
        std: Standard deviation of i_a that the measurement alone causes [kg m^2].
        reference: Description of the measurement.
        by_ratios: Derivatives of i_a by the fitted ratios c_c, k_c and tau'_c0 over I_A (3,).
        doubts: Warnings about the measurement.

    Raises:
        DoorParameterError: i_a is not positive or its standard deviation is negative.
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
        """Return this scale itself, which needs no fit."""
        return self


@dataclass(frozen=True)
class Fitted:
    """Results of a fit that a reference may need.

    Attributes:
        linkage: The closer's linkage.
        ratios: Fitted c_c (opening), k_c and tau'_c0, divided by I_A (3,).
        recording: The recording.
        swings: All free swings of the recording.
        play: Play between the leaf and its encoder [rad].
        zero: Angle that the encoder shows at the closed door [rad].
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
        """Return the scale from this measurement and the fitted ratios.

        Raises:
            NoScaleError: The measurement contradicts the fit.
        """


@dataclass(frozen=True)
class ForceReading:
    """Reading of a force gauge that holds the door still, at a right angle to the leaf.

    Attributes:
        angle: Opening angle [rad].
        force: Force [N].
        lever: Distance from the hinge to the point at which the force acts [m].
        force_std: Standard deviation of the force [N].
        lever_std: Standard deviation of the lever [m].

    Raises:
        DoorParameterError: Force, lever or force_std is not positive, angle or lever_std is
            negative, or force or lever is implausibly large.
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
        for name in ("angle", "lever_std"):
            require_not_negative(name, getattr(self, name))
        if self.force > _LARGEST_FORCE:
            raise DoorParameterError("force", self.force, f"up to {_LARGEST_FORCE:g} N")
        if self.lever > _LONGEST_LEVER:
            raise DoorParameterError("lever", self.lever, f"in metres, up to {_LONGEST_LEVER:g}")

    @property
    def torque(self) -> float:
        """Torque about the hinge [N m]."""
        return self.force * self.lever

    @property
    def torque_std(self) -> float:
        """Standard deviation of the torque [N m]."""
        return math.hypot(self.lever * self.force_std, self.force * self.lever_std)


@dataclass(frozen=True)
class ForceGauge:
    """Readings of a force gauge; each of them gives the restoring torque, eq. (12).

    Attributes:
        readings: One or more readings. They must not contain the friction at the hinge: read the
            gauge while the door creeps open and while it creeps shut, and use the mean.
    """

    readings: Sequence[ForceReading]

    def resolve(self, fitted: Fitted) -> Scale:
        """Return I_A by weighted least squares: measured torques over fitted torques per I_A.

        Raises:
            NoScaleError: There is no reading, or the fitted closer does not pull at its angle.
            LinkageError: The linkage does not close at the angle of a reading.
        """
        if not self.readings:
            raise NoScaleError(
                "there is no reading of the force gauge, at least one is needed",
                quantity="number of readings", value=0, limit=1)
        angles = np.array([row.angle for row in self.readings])
        fitted.linkage.require_within(angles)
        f, eta = fitted.linkage.f_and_eta(angles)
        slopes = np.column_stack([np.zeros(len(f)), eta * f, eta])
        pull = slopes @ fitted.ratios
        if not (pull > 0.0).all():
            raise NoScaleError(
                "the fitted closer does not pull at the angle of a reading, "
                f"{math.degrees(self.readings[int(np.argmin(pull))].angle):.1f} deg",
                quantity="fitted torque over I_A [1/s^2]",
                value=float(pull.min()),
                limit=0.0,
            )
        torque = np.array([row.torque for row in self.readings])
        weight = np.array([row.torque_std for row in self.readings]) ** -2.0
        information = float(weight @ pull**2)
        i_a = float(weight @ (torque * pull)) / information
        by_pull = weight * (torque - 2.0 * i_a * pull) / information
        # If the readings scatter more than their standard deviations, the result is less certain.
        excess = float(weight @ (torque - i_a * pull) ** 2) / max(1, len(torque) - 1)
        std = math.sqrt(max(1.0, excess) / information)
        doubts: tuple[str, ...] = () if excess < _APART else (
            "the readings of the force gauge contradict each other by "
            f"{math.sqrt(excess):.1f} times their standard deviations",)
        opened = np.degrees(angles[angles > 0.0])
        small = float(np.max(opened[opened < _RADIANS], initial=0.0))
        if small and (doubts or small == opened.max()):
            doubts += (
                f"the force gauge was read at {small:g} deg: if that is {small:g} rad, give "
                f"{math.degrees(small):.1f} deg",)
        plural = "" if len(torque) == 1 else "s"
        return Scale(
            i_a, std, f"{len(torque)} reading{plural} of a force gauge", by_pull @ slopes, doubts)


@dataclass(frozen=True)
class KnownImpulse:
    """A push whose angular impulse about the hinge was measured, such as by a recording gauge.

    Attributes:
        impulse: Time integral of force times lever while the leaf moved [N m s].
        std: Standard deviation of the impulse [N m s].
        swing: Number of the free swing that the push caused; the first one is 1.

    Raises:
        DoorParameterError: The impulse is not positive or implausibly large, its standard
            deviation is negative, or the number of the swing is not a whole number.
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
        """Return I_A by eq. (1), integrated from rest to the start of the free motion.

        The impulse is J = I_A (omega + time integral of the closer's torque over I_A), where omega
        is the angular velocity at the start of the free motion.

        Raises:
            NoScaleError: There is no such swing, or it did not begin from rest.
        """
        if not 1 <= self.swing <= len(fitted.swings):
            raise NoScaleError(
                f"the impulse belongs to swing {self.swing}, there are {len(fitted.swings)}",
                quantity="number of the swing", value=self.swing, limit=len(fitted.swings))
        swing, recording = fitted.swings[int(self.swing) - 1], fitted.recording
        period = float(np.median(np.diff(recording.t)))
        end = int(np.searchsorted(recording.t, swing.t[0]))
        theta = np.maximum(recording.theta - fitted.zero, 0.0)
        still = np.flatnonzero(theta[:end] <= _MOVED * recording.resolution)
        if not still.size:
            raise NoScaleError(
                f"the recording begins during the push of swing {self.swing}: it must show the "
                "door shut before the push", quantity="first angle [rad]", value=float(theta[0]),
                limit=0.0)
        moved = int(still[-1]) + 1
        push = slice(moved, end + 1)
        speed = smooth(theta[: end + round(0.1 / period)], period, 1)
        leaf = theta + max(fitted.play, 0.0)  # the leaf moves before its encoder does
        f, eta = fitted.linkage.f_and_eta(leaf[push])
        slopes = trapezoid(
            np.column_stack([eta**2 * speed[push], eta * f, eta]), recording.t[push], axis=0)
        # The leaf had already moved when its motion was first seen: for theta / omega after a
        # blow, and for three times as long under a torque that rises steadily.
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
    """Return the scale from a known moment of inertia, such as from a drawing.

    Args:
        i_a: Moment of inertia about the hinge [kg m^2].
        std: Standard deviation of i_a [kg m^2].

    Raises:
        NoScaleError: A value is not a number or out of its range.
    """
    if not (0.0 < i_a <= _LARGEST_INERTIA and 0.0 <= std <= _LARGEST_INERTIA):
        raise NoScaleError(
            f"a moment of inertia of {i_a} +- {std} kg m^2 fixes no scale",
            quantity="i_a, std [kg m^2]", value=(i_a, std),
            limit=f"positive numbers up to {_LARGEST_INERTIA:g}")
    return Scale(i_a, std, f"I_A of {i_a:g} kg m^2 as given")


def scale_from_leaf(
    mass: float | None, width: float | None, *, mass_std: float | None = None,
    width_std: float = WIDTH_STD
) -> Scale:
    """Return the scale from the leaf's mass and width, I_A = mass width^2 / 3.

    Args:
        mass: Mass of the leaf [kg].
        width: Distance from the hinge to the free edge [m].
        mass_std: Standard deviation of the mass [kg]; None means 0.5 % of the mass.
        width_std: Standard deviation of the width [m].

    Raises:
        NoScaleError: Mass or width is missing or not plausible.
    """
    for name, value in (("mass", mass), ("width", width)):
        if value is None or not (math.isfinite(value) and value > 0.0):
            raise NoScaleError(
                f"the leaf's {name} is {'missing' if value is None else value}: free swings fix "
                "only the ratios of I_A, c_c, k_c and tau'_c0, so weigh the leaf [kg] and "
                "measure its width [m] from hinge to free edge, or read the force that holds the "
                "door open",
                quantity=f"leaf {name}",
                value=value,
                limit="a positive number",
            )
        low, high = _PLAUSIBLE[name]
        if not low <= value <= high:
            raise NoScaleError(
                f"the leaf's {name} is {value:g}, must be {low:g} to {high:g}",
                quantity=f"leaf {name}", value=value, limit=(low, high))
    assert mass is not None
    assert width is not None
    mass_share = MASS_STD_SHARE if mass_std is None else mass_std / mass
    i_a = plate_moment_of_inertia(mass, width)
    std = i_a * math.hypot(mass_share, 2.0 * width_std / width)
    return Scale(i_a, std, f"I_A = m w^2 / 3 from a leaf of {mass:g} kg and {width:g} m")
