"""Identification of a door from free swings: section IV.A of the paper.

Free motion fixes only the ratios of the parameters (`trajectory_fit`); one further measurement
fixes their scale (`scale`).

The paper fits opening alone, from 10 deg to the peak. That determines k_c and tau'_c0 well but not
c_c: in five swings of 10 to 30 deg at 14,400 counts per turn, quantisation alone gives c_c a
standard deviation of 9 %. By default closing is therefore fitted too. It has a viscosity of its
own, because real closers damp closing far more than opening. If closing does not follow eq. (1),
which shows in the residuals, only opening is fitted.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import NDArray

from door_model.checks import require_positive
from door_model.door.closer import FourBarCloser
from door_model.door.door import Door
from door_model.door.geometry import Leaf, plate_moment_of_inertia
from door_model.errors import NoFitError, NoScaleError
from door_model.identification.fit_task import FitTask, Window, usable_swings
from door_model.identification.odd_swings import CommonFit
from door_model.identification.parameters import (
    PARAMETERS,
    RATIO_OF,
    UNITS,
    as_door,
    is_angle,
    to_parameters,
)
from door_model.identification.scale import Fitted, Reference, Scale
from door_model.identification.trajectory_fit import RatioFit
from door_model.recording.checks import (
    gap_doubts,
    grain,
    require_continuity,
    require_times,
    rest,
    with_lattice,
    without_garbage,
)
from door_model.recording.recording import Recording
from door_model.recording.swings import FoundSwings, FreeSwing, search

_EARLY = math.radians(0.5)  # a swing begins early if it begins this far below the start angle [rad]
_FEW = 4  # fewer swings than this cause a warning
_SCALE_DOUBT = 0.1  # standard deviation of I_A that causes a warning, relative to I_A
_ZERO_COUNTS_STD = 0.5  # standard deviation of the encoder's zero [counts]
_CLOSERS = (4.0, 280.0)  # torque at the shut door [N m]; EN 1154's sizes 1 to 7: 9 to 140
_PUSHED = math.radians(10.0)  # least peak of the largest of the pushes that are asked for [rad]
_PLATE = (0.5, 1.5)  # plausible moment of inertia of a leaf / that of a plate


@dataclass(frozen=True)
class SwingResult:
    """A swing and its fit.

    Attributes:
        t: Times in the recording (N,) [s]; where counts were recorded, the times at which the
            count changed.
        theta_measured: Measured angles (N,) [rad].
        theta_fitted: Fitted angles (N,) [rad].
        omega0: Fitted angular velocity at the first sample [rad/s].
        peak: Largest fitted angle of the leaf [rad].
        rmse: Root mean square of the residuals [rad].
    """

    t: Array = field(repr=False)
    theta_measured: Array = field(repr=False)
    theta_fitted: Array = field(repr=False)
    omega0: float
    peak: float
    rmse: float


@dataclass(frozen=True)
class Identification:
    """An identified door.

    Attributes:
        door: The door of eq. (1), with all fitted parameters.
        names: Names of the parameters (P,): `PARAMETERS`, then the other fitted parameters, such
            as "c_c_closing", "friction" or "latch_angle".
        values: Values of the parameters (P,), in SI units.
        covariance: Covariance of the parameters (P, P); it accounts for correlated residuals and
            contains the uncertainty of the scale.
        play: Play between the leaf and its encoder [rad].
        zero: Angle that the encoder shows at the closed door [rad].
        fit_rmse: Root mean square of all residuals [rad].
        swings: The fitted swings.
        window: Part of the swings that was fitted, OPENING or SWING.
        scale_reference: Description of the measurement that fixed the scale.
        warnings: What was left out, and what makes the result doubtful.
        assumptions: What was assumed to read the recording, such as its counts per turn.
        duration: Time from the first to the last sample of the recording [s].
        rate: Samples of the recording per second, between its gaps [1/s].
    """

    door: Door
    names: tuple[str, ...]
    values: Array
    covariance: Array
    play: float
    zero: float
    fit_rmse: float
    swings: list[SwingResult]
    window: Window
    scale_reference: str
    warnings: list[str]
    assumptions: tuple[str, ...] = ()
    duration: float = 0.0
    rate: float = 0.0

    def value_of(self, name: str) -> float:
        """Return the value of the parameter of this name."""
        return float(self.values[self.names.index(name)])

    def std_of(self, name: str) -> float:
        """Return the standard deviation of the parameter of this name."""
        place = self.names.index(name)
        return math.sqrt(float(self.covariance[place, place]))

    @property
    def correlation(self) -> Array:
        """Correlations of the parameters (P, P); 0 for a parameter that is exact."""
        std = np.sqrt(np.diag(self.covariance))
        scale = np.where(std > 0.0, std, np.inf)
        return np.asarray(self.covariance / np.outer(scale, scale))


def identify(
    recording: Recording, linkage: FourBarCloser, scale: Reference | None, *,
    window: Window | str = Window.AUTO, start_angle: float | None = None,
    extras: Sequence[str] = (), bounds: Mapping[str, tuple[float, float]] | None = None,
    zero_std: float | None = None, leaf: Leaf | None = None, force: bool = False
) -> Identification:
    """Identify a door from a recording of pushes by hand.

    Args:
        recording: Opening angle over time, zero at the closed door; swings need not be separated.
        linkage: The closer's linkage.
        scale: The measurement that fixes the scale, made by `scale_from_leaf`,
            `scale_from_inertia`, `ForceGauge` or `KnownImpulse` of the module `scale`.
        window: Part of the swings that is fitted.
        start_angle: Opening angle from which the swings are fitted [rad] (paper: 10 deg); None
            means from where the data show that the hand has left.
        extras: What is identified beyond the paper: names of `trajectory_fit.EXTRAS`.
        bounds: Lower and upper bounds by the parameter's name, in SI units; I_A has none, since
            the scale fixes it.
        zero_std: Standard deviation of the encoder's zero [rad]; None means half a count, or the
            distance from 0 at which the door is seen to rest, whichever is larger.
        leaf: The leaf, with whose mass and width I_A is compared; None: it is not known.
        force: Whether a closer is accepted whose torque no closer of EN 1154 has.

    Raises:
        NoScaleError: There is no scale, or it contradicts the recording.
        NoSwingError: The recording contains no free swing.
        NoFitError: The fit leads to no door or to no closer that is built, or its residuals are
            far too large.
        BadRecordingError: The times of the recording cannot be those of samples in seconds, or the
            angle leaps.
        DoorParameterError: A bound belongs to no parameter or is no interval, the start angle is
            not positive, or an extra is unknown.
    """
    window = Window(window)
    if scale is None:
        raise NoScaleError(
            "free swings fix only the ratios of I_A, c_c, k_c and tau'_c0: weigh the leaf and "
            "measure its width, or read the force that holds the door open",
            quantity="scale",
            value=None,
            limit="a leaf's mass and width, I_A, a force reading or a known impulse",
        )
    require_times(recording)
    if start_angle is not None:
        require_positive("the start angle", start_angle)
    clean, garbage_warnings = without_garbage(with_lattice(recording))
    require_continuity(clean)
    if zero_std is None:
        zero_std = max(_ZERO_COUNTS_STD * clean.resolution, abs(rest(clean)))
    task = FitTask(linkage, window, extras, zero_std, grain(clean))
    found = search(clean, start_angle)
    swings, swing_warnings = _swings_to_fit(clean, linkage, found, start_angle)
    common, fit_warnings = task.run(swings)
    fit, resolved, bound_warnings = _scaled(task, common, scale, clean, found, bounds or {})
    warnings = [*garbage_warnings, *gap_doubts(clean), *swing_warnings, *fit_warnings,
                *bound_warnings]
    result = replace(
        _result(fit, common.swings, linkage, resolved, warnings), assumptions=clean.assumptions,
        duration=float(np.ptp(recording.t)), rate=1.0 / float(np.median(np.diff(recording.t))))
    result.warnings.extend(_contradictions(result, leaf, refuse=not force))
    return result


def _contradictions(result: Identification, leaf: Leaf | None, *, refuse: bool) -> list[str]:
    """Return warnings if a closer, a leaf or pushes cannot be, as with wrong counts per turn.

    Raises:
        NoFitError: No closer has this torque at the shut door, and that is to be refused.
    """
    hint = " ".join([
        "check the counts per turn, mass and width of the leaf, and the linkage",
        *([f"(assumed: {', '.join(result.assumptions)})"] if result.assumptions else [])])
    torque, found = float(result.door.restoring_torque(0.0)), list[str]()
    low, high = _CLOSERS
    if not low <= torque <= high:
        problem = (
            f"the closer would pull with {torque:.3g} N m at the shut door, must be {low:g} to "
            f"{high:g} N m (EN 1154: 9 to 140 N m): {hint}")
        if refuse:
            raise NoFitError(
                f"{problem}; force (--force) accepts it",
                quantity="torque of the closer at 0 deg [N m]", value=torque, limit=_CLOSERS)
        found.append(problem)
    largest = max(swing.peak for swing in result.swings)
    if largest < _PUSHED:
        found.append(
            f"the largest swing is {math.degrees(largest):.1f} deg, must be "
            f"{math.degrees(_PUSHED):.0f} deg or more: {hint}")
    plate = plate_moment_of_inertia(leaf.mass, leaf.width) if leaf else result.door.i_a
    if not _PLATE[0] <= result.door.i_a / plate <= _PLATE[1]:
        found.append(
            f"I_A is {result.door.i_a:.3g} kg m^2, a leaf of this mass and width has "
            f"{plate:.3g} kg m^2, must be {_PLATE[0]:g} to {_PLATE[1]:g} times as much: {hint}")
    return found


def _swings_to_fit(
    clean: Recording, linkage: FourBarCloser, found: FoundSwings, start_angle: float | None
) -> tuple[list[FreeSwing], list[str]]:
    """Choose the swings that can be fitted, at the changes of the count where it is known.

    Returns:
        The swings, and warnings about the others.
    """
    swings, warnings = usable_swings(clean, linkage, found)
    if start_angle is not None:
        early = sum(float(swing.theta[0]) < start_angle - _EARLY for swing in swings)
        if early:
            warnings.append(
                f"{early} of {len(swings)} swings end too low to begin at "
                f"{math.degrees(start_angle):g} deg: they are fitted from where the hand had left")
    if clean.resolution > 0.0:
        swings = [swing.at_edges(clean.resolution) for swing in swings]
    return swings, warnings


def _scaled(
    task: FitTask, common: CommonFit, scale: Reference, clean: Recording, found: FoundSwings,
    bounds: Mapping[str, tuple[float, float]]
) -> tuple[RatioFit, Scale, list[str]]:
    """Resolve the scale; where there are bounds, fit again within them and resolve it again.

    Returns:
        The fit, the scale, and warnings about values at their bounds.
    """
    fit = common.fit
    fitted = Fitted(
        task.linkage, _paper_ratios(fit), clean, found.swings, fit.value("play"), fit.value("zero"))
    resolved = scale.resolve(fitted)
    if not bounds:
        return fit, resolved, []
    fit, warnings = task.within(common, bounds, resolved.i_a)
    return fit, scale.resolve(replace(fitted, ratios=_paper_ratios(fit))), warnings


def _paper_ratios(fit: RatioFit) -> Array:
    """Return c_c (opening), k_c and tau'_c0, divided by I_A (3,)."""
    return fit.values[[fit.free.index(RATIO_OF[name]) for name in PARAMETERS[1:]]]


def _result(
    fit: RatioFit, swings: Sequence[FreeSwing], linkage: FourBarCloser, scale: Scale,
    warnings: list[str]
) -> Identification:
    """Combine the fitted ratios and the scale to the result, and add the remaining warnings."""
    names, values, covariance = to_parameters(fit.free, fit.values, fit.covariance, scale)
    _, _, by_swings = to_parameters(fit.free, fit.values, fit.covariance, Scale(scale.i_a, 0.0, ""))
    warnings += doubts(names[1:], values[1:], by_swings[1:, 1:])
    warnings += [
        f"the swings fit as well with {name} at {math.degrees(angle):.1f} deg: record more swings "
        "of more different sizes to decide"
        for name, angle in fit.rivals.items()
    ]
    results = []
    for swing, fitted, peak, start, rmse in zip(
        swings, fit.fitted, fit.peaks, fit.starts, fit.swing_rmse, strict=True):
        n = len(fitted)
        results.append(
            SwingResult(
                t=swing.t[:n], theta_measured=swing.theta[:n], theta_fitted=fitted,
                omega0=float(start[1]), peak=float(peak), rmse=float(rmse))
        )
    if len(results) < _FEW:
        warnings.append(
            f"only {len(results)} swing{'' if len(results) == 1 else 's'}: record five of "
            "different size; among so few a bad swing cannot be recognised")
    warnings += scale.doubts
    if scale.std > _SCALE_DOUBT * scale.i_a:
        warnings.append(
            f"the scale is uncertain by {scale.std / scale.i_a:.0%}, and so is every parameter")
    return Identification(
        door=as_door(names, values, linkage), names=names, values=values, covariance=covariance,
        play=fit.value("play"), zero=fit.value("zero"), fit_rmse=fit.rmse, swings=results,
        window=Window.SWING if "closing" in fit.free else Window.OPENING,
        scale_reference=scale.reference, warnings=warnings)


_DOUBTFUL = 0.1  # standard deviation that causes a warning, relative to the value
_PART = 0.3  # smallest component with which a parameter takes part in an uncertain direction
_NOTHING = 1e-3  # a value below this many standard deviations is at its bound of 0


def doubts(
    names: Sequence[str], values: NDArray[np.float64], covariance: NDArray[np.float64]
) -> list[str]:
    """Return sentences on the directions in which parameters are uncertain by more than a tenth.

    Args:
        names: Names of the parameters (P,), as in the module `parameters`.
        values: Values of the parameters (P,), in SI units.
        covariance: Covariance of the parameters (P, P), without the uncertainty of the scale,
            which has nothing to do with the swings.
    """
    std = np.sqrt(np.diag(covariance))
    size = np.maximum(np.maximum(np.abs(values), std), 1e-12)
    shares, directions = np.linalg.eigh(covariance / np.outer(size, size))
    warnings: dict[tuple[str, ...], str] = {}
    for variance, direction in sorted(
        zip(shares, directions.T, strict=True), key=lambda pair: -pair[0]):
        share = math.sqrt(max(float(variance), 0.0))
        parts = tuple(
            name for name, part in zip(names, direction, strict=True) if abs(part) > _PART)
        if share > _DOUBTFUL and len(parts) > 1:
            warnings.setdefault(parts, (
                f"the swings cannot tell {' and '.join(parts)} apart: if they change together by "
                f"{min(share, 1.0):.0%}, the motion stays nearly the same"))
    together = {name for parts in warnings for name in parts}
    return [*warnings.values(), *(
        _uncertain(name, float(value), float(spread))
        for name, value, spread in zip(names, values, std, strict=True)
        if spread > _DOUBTFUL * abs(value) and name not in together)]


def _uncertain(name: str, value: float, std: float) -> str:
    """Return a sentence on the uncertainty of a single parameter."""
    unit = UNITS[name]
    if is_angle(name):
        value, std, unit = math.degrees(value), math.degrees(std), "deg"
    if abs(value) < _NOTHING * std:
        return f"{name} is at its bound of 0, +- {std:.2g} {unit}"
    return f"{name} is uncertain: {value:.3g} +- {std:.2g} {unit}"
