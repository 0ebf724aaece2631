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
from dataclasses import dataclass, field, replace

import numpy as np
from door_impact_common.arrays import Array

from door_model.checks import require_positive
from door_model.door.closer import FourBarCloser
from door_model.door.door import Door
from door_model.errors import NoScaleError
from door_model.identification.doubts import doubts
from door_model.identification.parameters import PARAMETERS, RATIO_OF, as_door, to_parameters
from door_model.identification.scale import Fitted, Reference, Scale
from door_model.identification.swing_fit import SwingFit, Window, usable_swings
from door_model.identification.trajectory_fit import RatioFit
from door_model.recording.checks import grain, require_times, rest, with_lattice, without_garbage
from door_model.recording.recording import Recording
from door_model.recording.swings import FreeSwing, search

PAPER_START_ANGLE = math.radians(10.0)  # section IV.A
_EARLY = math.radians(0.5)  # below the start angle
_FEW = 4  # swings
_SCALE_DOUBT = 0.1  # of I_A
_ZERO_COUNTS_STD = 0.5  # of the encoder's zero, in counts


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
        door: The door of eq. (1), with all that was fitted.
        names: Names of the parameters (P,): `PARAMETERS`, then what else was fitted, such as
            "c_c_closing", "friction" or "latch_angle".
        values: Their values (P,), in SI units.
        covariance: (P, P) of the same; for correlated residuals, and with the scale's share.
        play: Between the leaf and its encoder [rad].
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
    play: float
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
        zero_std: Standard deviation of the encoder's zero [rad]; by default half a count, or as
            far from 0 as the door is seen to rest.

    Raises:
        NoScaleError: There is no scale, or it does not fit to what the recording shows.
        NoSwingError: Nothing in the recording looks like a free swing.
        NoFitError: The fit leads to no door, or leaves far too much of the swings.
        BadRecordingError: Its times cannot be those of samples in seconds.
        DoorParameterError: A bound is of no parameter or no interval, the start angle is not
            positive, or there is no such extra.
    """
    window = Window(window)
    if scale is None:
        raise NoScaleError(
            "free swings fix only the ratios of I_A, c_c, k_c and tau'_c0: weigh the leaf and "
            "measure its width, or read the force that holds the door open",
            value=None,
            limit="a leaf's mass and width, I_A, a force reading or a known impulse",
        )
    require_times(recording)
    if start_angle is not None:
        require_positive("the start angle", start_angle)
    clean, warnings = without_garbage(with_lattice(recording))
    if zero_std is None:
        zero_std = max(_ZERO_COUNTS_STD * clean.resolution, abs(rest(clean)))
    task = SwingFit(linkage, window, extras, zero_std, grain(clean))
    found = search(clean, start_angle)
    swings, said = usable_swings(clean, linkage, found)
    warnings += said
    if start_angle is not None:
        early = sum(float(swing.theta[0]) < start_angle - _EARLY for swing in swings)
        if early:
            warnings.append(
                f"{early} swing{'' if early == 1 else 's'} of {len(swings)} end too low to begin "
                f"at {math.degrees(start_angle):g} deg: taken from where the hand had left")
    if clean.resolution > 0.0:
        swings = [swing.at_edges(clean.resolution) for swing in swings]
    common, said = task.run(swings)
    warnings += said
    fit = common.fit
    fitted = Fitted(
        linkage, _paper_ratios(fit), clean, found.swings, fit.value("play"), fit.value("zero"))
    resolved = scale.resolve(fitted)
    if bounds:
        fit, said = task.within(common, bounds, resolved.i_a)
        warnings += said
        resolved = scale.resolve(replace(fitted, ratios=_paper_ratios(fit)))
    return _result(fit, common.swings, linkage, resolved, warnings)


def _paper_ratios(fit: RatioFit) -> Array:
    """c_c (opening), k_c and tau'_c0 over I_A (3,)."""
    return fit.values[[fit.free.index(RATIO_OF[name]) for name in PARAMETERS[1:]]]


def _result(
    fit: RatioFit,
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
    if len(results) < _FEW:
        warnings.append(
            f"only {len(results)} swing{'' if len(results) == 1 else 's'}: use five of different "
            "size; of so few none can be told to be the odd one")
    warnings += scale.doubts
    if scale.std > _SCALE_DOUBT * scale.i_a:
        warnings.append(
            f"the scale is uncertain by {scale.std / scale.i_a:.0%}, and with it all parameters")
    return Identification(
        door=as_door(names, values, linkage),
        names=names,
        values=values,
        covariance=covariance,
        play=fit.value("play"),
        zero=fit.value("zero"),
        fit_rmse=fit.rmse,
        swings=results,
        window=Window.SWING if "closing" in fit.free else Window.OPENING,
        scale_reference=scale.reference,
        warnings=warnings,
    )
