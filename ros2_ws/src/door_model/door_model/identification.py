"""Identification of a door from free swings: section IV.A of the paper.

Free motion fixes ratios only (`trajectory_fit`), one measurement more the scale (`scale`).

The paper fits opening alone, from 10 deg to the peak. That fixes k_c and tau'_c0 well but not c_c:
in five swings of 10 to 30 deg seen by 14,400 counts a turn the quantisation alone leaves c_c a
standard deviation of 9 %. By default the fall shut is therefore fitted too, with a viscosity of
its own, because real closers damp closing far more than opening. Where closing does not follow
eq. (1), which shows in the residuals, the fit goes back to opening alone.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from door_model.closer import FourBarCloser
from door_model.door import Door
from door_model.doubts import doubts
from door_model.errors import DoorParameterError, NoFitError, NoScaleError, NoSwingError
from door_model.garbage import without_garbage
from door_model.odd_swings import CommonFit, fit_common, said_of
from door_model.parameters import as_door, ratio_bounds, to_parameters
from door_model.recordings import Recording
from door_model.scale import Fitted, Reference, Scale
from door_model.swings import MIN_PEAK, FreeSwing, find_swings
from door_model.trajectory_fit import EXTRAS, OPENING, SWING, RatioFit, fit_ratios

Array = NDArray[np.float64]

PAPER_START_ANGLE = math.radians(10.0)  # section IV.A
_WORSE = 1.3  # closing is left out where it raises the residuals by more than this factor
_BETTER = 0.7  # share of the residuals that something beyond the paper must leave
_SUSPICIOUS_RMSE = 0.3  # counts; quantisation alone leaves 0.2
_ZERO_COUNTS_STD = 0.5  # of the encoder's zero, in counts
_GOOD_RMSE = 0.5  # counts; a fit this good hides no odd swing


class Window(Enum):
    """Which part of a swing is fitted."""

    AUTO = "auto"  # opening and closing; opening alone where closing does not follow eq. (1)
    OPENING = "opening"  # to the peak, as in the paper
    SWING = "swing"  # opening and closing


@dataclass(frozen=True)
class SwingResult:
    """One swing and its fit.

    Attributes:
        t: Times in the recording (N,) [s]: those at which the count changed, where counts were
            recorded.
        theta_measured: Measured angles (N,) [rad].
        theta_fitted: Fitted angles (N,) [rad].
        omega0: Fitted angular velocity at the first sample [rad/s].
        peak: Largest fitted angle of the leaf [rad].
        rmse: Root mean square of the residuals [rad].
    """

    t: Array
    theta_measured: Array
    theta_fitted: Array
    omega0: float
    peak: float
    rmse: float


@dataclass(frozen=True)
class Identification:
    """An identified door.

    Attributes:
        door: The door of eq. (1), with all that was fitted.
        names: Names of the parameters (P,): `PARAMETERS`, then what else was fitted, such as
            "c_c_closing", "friction" or "latch_angle".
        values: Their values (P,), in SI units.
        covariance: (P, P) of the same; for correlated residuals, and with the scale's share.
        play: Between the leaf and its encoder [rad]; None where only opening was fitted.
        zero: What the encoder shows at the closed door [rad].
        fit_rmse: Root mean square of all residuals [rad].
        swings: The swings used.
        window: What was fitted, OPENING or SWING.
        scale_reference: What fixed the scale.
        warnings: What was left out, and what to know before the figures are trusted.
    """

    door: Door
    names: tuple[str, ...]
    values: Array
    covariance: Array
    play: float | None
    zero: float
    fit_rmse: float
    swings: list[SwingResult]
    window: Window
    scale_reference: str
    warnings: list[str]

    def value_of(self, name: str) -> float:
        """Value of one of `names`."""
        return float(self.values[self.names.index(name)])

    def std_of(self, name: str) -> float:
        """Standard deviation of one of `names`."""
        place = self.names.index(name)
        return math.sqrt(float(self.covariance[place, place]))

    @property
    def correlation(self) -> Array:
        """Correlations (P, P) of the parameters; 0 with one that is exact."""
        std = np.sqrt(np.diag(self.covariance))
        scale = np.where(std > 0.0, std, np.inf)
        return np.asarray(self.covariance / np.outer(scale, scale))


def identify(
    recording: Recording,
    linkage: FourBarCloser,
    scale: Reference | None,
    *,
    window: Window | str = Window.AUTO,
    start_angle: float | None = None,
    extras: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    zero_std: float | None = None,
) -> Identification:
    """Identify a door from a recording of pushes by hand.

    Args:
        recording: Angle over time, zero at the closed door; swings need not be separated.
        linkage: The closer's linkage.
        scale: What fixes the scale: of `scale`, `scale_from_leaf` or `scale_from_inertia`,
            `ForceGauge` or `KnownImpulse`.
        window: Which part of the swings to fit.
        start_angle: Fit from this angle on [rad] (paper: `PAPER_START_ANGLE`) rather than from
            where the data say that the hand has left.
        extras: What to identify beyond the paper: names of `trajectory_fit.EXTRAS`.
        bounds: Lower and upper bounds by parameter's name, in SI units; I_A is the scale's.
        zero_std: Standard deviation of the encoder's zero [rad]; by default half a count.

    Raises:
        NoScaleError: There is no scale, or it does not fit to what the recording shows.
        NoSwingError: Nothing in the recording looks like a free swing.
        NoFitError: The fit does not converge, or what it finds is no door.
        DoorParameterError: A bound is of no parameter or no interval, or there is no such extra.
    """
    window = Window(window)
    if scale is None:
        raise NoScaleError(
            "free swings fix only the ratios of I_A, c_c, k_c and tau'_c0: weigh the leaf and "
            "measure its width, or read the force that holds the door open",
            value=None,
            limit="a leaf's mass and width, I_A, a force reading or a known impulse",
        )
    free = (*SWING, *(name for extra in extras for name in _extra(extra)))
    zero_std = _ZERO_COUNTS_STD * recording.resolution if zero_std is None else zero_std
    clean, warnings = without_garbage(recording)
    swings = _usable(clean, linkage, start_angle, warnings)
    if clean.resolution > 0.0:
        swings = [swing.at_edges(clean.resolution) for swing in swings]
    common, used = _fit(linkage, swings, free, window, zero_std, clean.resolution, warnings)
    if window is not Window.OPENING and common.fit.rmse > _SUSPICIOUS_RMSE * clean.resolution:
        warnings += _missing(linkage, common, free, zero_std)
    fitted = Fitted(linkage, _paper_ratios(common.fit), clean, common.swings)
    resolved = scale.resolve(fitted)
    fit = common.fit
    if bounds:
        fit = _bounded(linkage, common, bounds, resolved.i_a, zero_std, warnings)
        resolved = scale.resolve(replace(fitted, ratios=_paper_ratios(fit)))
    return _result(fit, used, common.swings, linkage, resolved, warnings)


def _extra(name: str) -> tuple[str, ...]:
    """What is fitted for one of `EXTRAS`."""
    if name not in EXTRAS:
        raise DoorParameterError("an extra", name, f"of {', '.join(EXTRAS)}")
    return EXTRAS[name]


def _paper_ratios(fit: RatioFit) -> Array:
    """c_c (opening), k_c and tau'_c0 over I_A (3,)."""
    return fit.values[[fit.free.index(name) for name in OPENING]]


def _usable(
    recording: Recording, linkage: FourBarCloser, start_angle: float | None, warnings: list[str]
) -> list[FreeSwing]:
    """The free swings that stay where the linkage closes and that nothing stopped."""
    lowest, limit = linkage.closing_limit(), linkage.opening_limit()
    usable = []
    for swing in find_swings(recording, start_angle):
        top = math.degrees(float(swing.theta.max()))
        if swing.stopped:
            warnings.append(
                f"the swing at {swing.t[0]:.1f} s was left out: it hit something at {top:.1f} deg")
        elif not (lowest < float(swing.theta.min()) and top < math.degrees(limit)):
            warnings.append(
                f"the swing at {swing.t[0]:.1f} s was left out: it goes from "
                f"{math.degrees(float(swing.theta.min())):.1f} to {top:.1f} deg, the linkage from "
                f"{math.degrees(lowest):.1f} to {math.degrees(limit):.1f} deg")
        else:
            usable.append(swing)
    if usable:
        return usable
    if not len(recording.t):
        raise NoSwingError("the recording is empty", limit=MIN_PEAK)
    highest = float(recording.theta.max())
    raise NoSwingError(
        f"no free swing above {math.degrees(MIN_PEAK):.0f} deg in "
        f"{recording.t[-1] - recording.t[0]:.1f} s of recording (largest angle "
        f"{math.degrees(highest):.2f} deg): push the shut door once, let go, and wait until it has "
        "fallen shut" + "".join(f"; {warning}" for warning in warnings),
        value=highest,
        limit=MIN_PEAK,
    )


def _fit(
    linkage: FourBarCloser,
    swings: Sequence[FreeSwing],
    free: tuple[str, ...],
    window: Window,
    zero_std: float,
    resolution: float,
    warnings: list[str],
) -> tuple[CommonFit, Window]:
    """Fit what was asked for; opening alone where closing does not follow the model."""
    good = _GOOD_RMSE * resolution
    if window is not Window.OPENING and not any(
        len(swing.t) - swing.peak_index > len(swing.t) // 4 for swing in swings
    ):
        warnings.append("no swing falls shut by itself: only opening was fitted")
        window = Window.OPENING
    both = None
    if window is not Window.OPENING:
        try:
            both = fit_common(linkage, swings, free, zero_std=zero_std, good_rmse=good)
        except NoFitError:
            if window is Window.SWING:
                raise
        else:
            if window is Window.SWING or both.fit.rmse <= good:
                warnings += said_of(both.left_out)
                return both, Window.SWING
    opening = fit_common(linkage, swings, OPENING, zero_std=zero_std, good_rmse=good)
    if window is Window.OPENING:
        warnings += said_of(opening.left_out)
        return opening, window
    if both is not None and both.fit.rmse <= _WORSE * max(opening.fit.rmse, zero_std):
        warnings += said_of(both.left_out)
        return both, Window.SWING
    warnings += said_of(opening.left_out)
    warnings.append(
        "closing does not follow eq. (1) with one viscosity: only opening was fitted, as in the "
        "paper, which leaves c_c less certain")
    return opening, Window.OPENING


def _missing(
    linkage: FourBarCloser, common: CommonFit, free: tuple[str, ...], zero_std: float
) -> list[str]:
    """Say what else the swings ask for, if something beyond the paper explains far more of them."""
    fits = {}
    for name, own in EXTRAS.items():
        if not set(own) <= set(free):
            with suppress(NoFitError):
                fits[name] = fit_ratios(linkage, common.swings, (*free, *own), zero_std=zero_std)
    best = min(fits, key=lambda name: fits[name].rmse, default=None)
    if best is None or fits[best].rmse > _BETTER * common.fit.rmse:
        return []
    return [
        f"with {best} identified too the residuals would fall from "
        f"{math.degrees(common.fit.rmse):.4f} to {math.degrees(fits[best].rmse):.4f} deg: do so"
    ]


def _bounded(
    linkage: FourBarCloser,
    common: CommonFit,
    bounds: Mapping[str, tuple[float, float]],
    i_a: float,
    zero_std: float,
    warnings: list[str],
) -> RatioFit:
    """The fit again, within bounds of the parameters."""
    free = tuple(name for name in common.fit.free if name != "zero")
    ratios = ratio_bounds(bounds, i_a)
    for name, ratio in zip(bounds, ratios, strict=True):
        if ratio not in free:
            raise DoorParameterError("the parameter of a bound", name, "one that is fitted")
    fit = fit_ratios(
        linkage, common.swings, free, zero_std=zero_std, bounds=ratios,
        first=dict(zip(common.fit.free, common.fit.values, strict=True)))
    for name, (ratio, span) in zip(bounds, ratios.items(), strict=True):
        value = fit.value(ratio)
        if value is not None and min(value - span[0], span[1] - value) < 1e-3 * (span[1] - span[0]):
            warnings.append(f"{name} lies at its bound: the swings ask for one beyond it")
    return fit


def _result(
    fit: RatioFit,
    used: Window,
    swings: Sequence[FreeSwing],
    linkage: FourBarCloser,
    scale: Scale,
    warnings: list[str],
) -> Identification:
    """Put ratios and scale together."""
    names, values, covariance = to_parameters(fit.free, fit.values, fit.covariance, scale)
    _, _, by_swings = to_parameters(fit.free, fit.values, fit.covariance, Scale(scale.i_a, 0.0, ""))
    warnings += doubts(names[1:], values[1:], by_swings[1:, 1:])
    warnings += [
        f"the swings fit as well with {name} at {math.degrees(angle):.1f} deg: more of them, of "
        "more different sizes, would tell"
        for name, angle in fit.rivals.items()
    ]
    results = []
    for swing, fitted, peak, start, rmse in zip(
        swings, fit.fitted, fit.peaks, fit.starts, fit.swing_rmse, strict=True
    ):
        n = len(fitted)
        results.append(
            SwingResult(
                t=swing.t[:n],
                theta_measured=swing.theta[:n],
                theta_fitted=fitted,
                omega0=float(start[1]),
                peak=float(peak),
                rmse=float(rmse),
            )
        )
    if len(results) < 3:
        warnings.append(f"only {len(results)} swing(s): use five of different size")
    return Identification(
        door=as_door(names, values, linkage),
        names=names,
        values=values,
        covariance=covariance,
        play=fit.value("play"),
        zero=fit.value("zero") or 0.0,
        fit_rmse=fit.rmse,
        swings=results,
        window=used,
        scale_reference=scale.reference,
        warnings=warnings,
    )
