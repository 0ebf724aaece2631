"""Identification of a door from free swings: section IV.A of the paper.

Free motion fixes ratios only (`trajectory_fit`), the leaf's mass and width fix the scale (`scale`).

The paper fits opening alone, from 10 deg to the peak. That fixes k_c and tau'_c0 well but not c_c:
in five swings of 10 to 30 deg seen by 14,400 counts a turn the quantisation alone leaves c_c a
standard deviation of 9 %. By default the fall shut is therefore fitted too, with a viscosity of
its own, because real closers damp closing far more than opening. Where closing does not follow
eq. (1), which shows in the residuals, the fit goes back to opening alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from door_model.closer import FourBarCloser
from door_model.door import Door
from door_model.errors import NoFitError, NoScaleError, NoSwingError
from door_model.recordings import Recording
from door_model.scale import Fitted, Reference
from door_model.swings import MIN_PEAK, FreeSwing, find_swings
from door_model.trajectory_fit import RatioFit, fit_ratios

Array = NDArray[np.float64]

PARAMETERS = ("i_a", "c_c", "k_c", "tau_c0_prime")
PAPER_START_ANGLE = math.radians(10.0)  # section IV.A
_WORSE = 1.3  # closing is left out where it raises the residuals by more than this factor
_OUTLIER_GAIN = 0.5  # a swing is left out where that brings the rmse below this share
_MOST_TRIED = 12  # swings; among more of them a single bad one hardly counts
_ZERO_COUNTS_STD = 0.5  # of the encoder's zero, in counts


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
        door: The door of eq. (1).
        i_a: Moment of inertia [kg m^2].
        c_c: Viscosity while opening [N m s/rad].
        k_c: Spring coefficient [N m/rad].
        tau_c0_prime: tau'_c0 of eq. (12) [N m].
        covariance: (4, 4) of (i_a, c_c, k_c, tau_c0_prime).
        std: (4,) standard deviations of the same.
        c_c_closing: Viscosity while closing [N m s/rad]; None where only opening was fitted.
        play: Between the leaf and its encoder [rad]; None where only opening was fitted.
        fit_rmse: Root mean square of all residuals [rad].
        swings: The swings used.
        window: What was fitted, OPENING or SWING.
        scale_reference: What fixed the scale.
        warnings: What to know before the figures are trusted.
    """

    door: Door
    i_a: float
    c_c: float
    k_c: float
    tau_c0_prime: float
    covariance: Array
    std: Array
    c_c_closing: float | None
    play: float | None
    fit_rmse: float
    swings: list[SwingResult]
    window: Window
    scale_reference: str
    warnings: list[str]

    def std_of(self, parameter: str) -> float:
        """Standard deviation of one of `PARAMETERS`."""
        return float(self.std[PARAMETERS.index(parameter)])


def identify(
    recording: Recording,
    linkage: FourBarCloser,
    scale: Reference | None,
    *,
    window: Window | str = Window.AUTO,
    start_angle: float | None = None,
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

    Raises:
        NoScaleError: There is no scale, or it does not fit to what the recording shows.
        NoSwingError: Nothing in the recording looks like a free swing.
        NoFitError: The fit does not converge, or what it finds is no door.
    """
    window = Window(window)
    if scale is None:
        raise NoScaleError(
            "free swings fix only the ratios of I_A, c_c, k_c and tau'_c0: weigh the leaf and "
            "measure its width, or read the force that holds the door open",
            value=None,
            limit="a leaf's mass and width, I_A, a force reading or a known impulse",
        )
    swings = _inside(find_swings(recording, start_angle), linkage)
    if not swings:
        raise NoSwingError(
            f"no free swing above {math.degrees(MIN_PEAK):.0f} deg in "
            f"{recording.t[-1] - recording.t[0]:.1f} s of recording (largest angle "
            f"{math.degrees(float(recording.theta.max())):.2f} deg): push the shut door once, let "
            "go, and wait until it has fallen shut"
            if len(recording.t)
            else "the recording is empty",
            value=float(recording.theta.max()) if len(recording.t) else None,
            limit=MIN_PEAK,
        )
    if recording.resolution > 0.0:
        swings = [swing.at_edges(recording.resolution) for swing in swings]
    warnings: list[str] = []
    zero_std = _ZERO_COUNTS_STD * recording.resolution
    opening = fit_ratios(linkage, swings, with_closing=False, zero_std=zero_std)
    if opening.rmse > recording.resolution and 4 <= len(swings) <= _MOST_TRIED:
        swings, opening = _without_touched(linkage, swings, opening, zero_std, warnings)
    fit, used = _add_closing(linkage, swings, window, opening, zero_std, warnings)
    return _result(fit, used, swings, linkage, scale, recording, warnings)


def _inside(swings: Sequence[FreeSwing], linkage: FourBarCloser) -> list[FreeSwing]:
    """Swings that stay where the linkage closes."""
    limit = linkage.opening_limit()
    return [swing for swing in swings if float(swing.theta.max()) < limit]


def _without_touched(
    linkage: FourBarCloser,
    swings: list[FreeSwing],
    all_swings: RatioFit,
    zero_std: float,
    warnings: list[str],
) -> tuple[list[FreeSwing], RatioFit]:
    """Leave out the one swing that does not open as the others do, if there is one.

    One bad swing pulls the fit of all with it, so each is tried without.
    """
    rests = [swings[:i] + swings[i + 1 :] for i in range(len(swings))]
    trials = [fit_ratios(linkage, rest, with_closing=False, zero_std=zero_std) for rest in rests]
    best = int(np.argmin([trial.rmse for trial in trials]))
    if trials[best].rmse > _OUTLIER_GAIN * all_swings.rmse:
        return swings, all_swings
    warnings.append(
        f"the swing at {swings[best].t[0]:.1f} s was left out: it does not move as the others do; "
        "was the door touched?"
    )
    return rests[best], trials[best]


def _add_closing(
    linkage: FourBarCloser,
    swings: Sequence[FreeSwing],
    window: Window,
    opening: RatioFit,
    zero_std: float,
    warnings: list[str],
) -> tuple[RatioFit, Window]:
    """Go on from the fit of opening alone to the part of the swings that was asked for."""
    if window is Window.OPENING:
        return opening, window
    if not any(len(swing.t) - swing.peak_index > len(swing.t) // 4 for swing in swings):
        warnings.append("no swing falls shut by itself: only opening was fitted")
        return opening, Window.OPENING
    try:
        both = fit_ratios(linkage, swings, with_closing=True, zero_std=zero_std, first=opening)
    except NoFitError:
        if window is Window.SWING:
            raise
    else:
        if window is Window.SWING or both.rmse <= _WORSE * max(opening.rmse, zero_std):
            return both, Window.SWING
    warnings.append(
        "closing does not follow eq. (1) with one viscosity: only opening was fitted, as in the "
        "paper, which leaves c_c less certain"
    )
    return opening, Window.OPENING


def _result(
    fit: RatioFit,
    used: Window,
    swings: Sequence[FreeSwing],
    linkage: FourBarCloser,
    reference: Reference,
    recording: Recording,
    warnings: list[str],
) -> Identification:
    """Put ratios and scale together."""
    own = [0, 2, 3]  # opening viscosity, spring, preload
    ratios = fit.ratios[own]
    scale = reference.resolve(Fitted(linkage, ratios, recording, swings))
    factors = np.concatenate([[1.0], ratios])
    by_ratios = np.outer(factors, scale.by_ratios)
    by_ratios[1:] += scale.i_a * np.eye(len(own))
    covariance = by_ratios @ fit.covariance[np.ix_(own, own)] @ by_ratios.T
    covariance += np.outer(factors, factors) * scale.std**2
    std = np.sqrt(np.diag(covariance))
    values = scale.i_a * ratios
    for name, value, spread in zip(PARAMETERS[1:], values, std[1:], strict=True):
        if spread > 0.1 * value:
            warnings.append(f"{name} is uncertain: {value:.3g} +- {spread:.2g}; push further")
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
        door=Door(scale.i_a, float(values[0]), float(values[1]), float(values[2]), linkage),
        i_a=scale.i_a,
        c_c=float(values[0]),
        k_c=float(values[1]),
        tau_c0_prime=float(values[2]),
        covariance=covariance,
        std=std,
        c_c_closing=float(scale.i_a * fit.ratios[1]) if used is Window.SWING else None,
        play=fit.play if used is Window.SWING else None,
        fit_rmse=fit.rmse,
        swings=results,
        window=used,
        scale_reference=scale.reference,
        warnings=warnings,
    )
