"""Fit that leaves out the swings that do not move as the others do."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from door_model.door.closer import FourBarCloser
from door_model.errors import NoFitError
from door_model.identification.trajectory_fit import RatioFit, fit_ratios
from door_model.recording.swings import FreeSwing

CHANGED = "closer_changed"  # reason of an error
_GAIN = 0.5  # a swing is left out if that brings the residuals below this share of theirs
_MOST_TRIED = 12  # largest number of swings that are left out on trial in a round
_LEAST_LEFT = 3  # no swing is left out of this number: the odd one could not be recognised
_MOST_OUT = 1.0 / 3.0  # largest share of the swings that is left out
_APART = 0.25  # swings are of two closers if two fits leave less than this share of the residuals


@dataclass(frozen=True)
class CommonFit:
    """A fit and its swings.

    Attributes:
        fit: The fit.
        swings: The swings to which it was fitted.
        left_out: The swings that were left out because they move differently.
    """

    fit: RatioFit
    swings: list[FreeSwing]
    left_out: list[FreeSwing]


def fit_common(
    linkage: FourBarCloser, swings: Sequence[FreeSwing], free: tuple[str, ...], *, zero_std: float,
    good_rmse: float, first: Mapping[str, float] | None = None
) -> CommonFit:
    """Fit the ratios to the swings that agree with each other.

    One bad swing distorts the fit of all, so the fit is repeated without each of the worst swings.

    Args:
        linkage: The linkage.
        swings: The swings.
        free: Names of the unknowns, as in `trajectory_fit.fit_ratios`.
        zero_std: Standard deviation of the encoder's zero [rad].
        good_rmse: Residuals [rad] up to which no odd swing is looked for.
        first: First guesses by name, as in `trajectory_fit.fit_ratios`.

    Raises:
        NoFitError: The swings cannot be fitted, even without the worst ones, or the closer was
            changed between two of them, with the reason `CHANGED`.
    """
    kept = list(swings)
    out: list[FreeSwing] = []
    known = dict(first or {})
    fit = of_all = _tried(linkage, kept, free, zero_std, known)
    while _rmse(fit) > good_rmse and len(kept) > _LEAST_LEFT and (
        len(out) + 1 <= _MOST_OUT * len(swings)):
        worst = range(len(kept)) if isinstance(fit, NoFitError) else np.argsort(-fit.swing_rmse)
        trials = {
            int(odd): _tried(linkage, kept[:odd] + kept[odd + 1 :], free, zero_std, known)
            for odd in worst[:_MOST_TRIED]
        }
        best = min(trials, key=lambda odd: _rmse(trials[odd]))
        if not _rmse(trials[best]) < _GAIN * _rmse(fit):
            break
        out.append(kept.pop(best))
        fit = trials[best]
    if len(out) > 1 or _rmse(fit) > good_rmse:
        limit = min(good_rmse, _APART * _rmse(of_all))
        parts = [list(swings[:2])]  # swings that follow each other and agree
        for swing in swings[2:]:
            more = [*parts[-1], swing]
            if len(more) == 2 or _rmse(_tried(linkage, more, free, zero_std, known)) <= limit:
                parts[-1] = more
            else:
                parts.append([swing])
        if len(parts) > 1 and all(
                len(part) > 1 and _rmse(_tried(linkage, part, free, zero_std, known)) <= limit
                for part in parts):
            before, *after = (", ".join(f"{swing.t[0]:.1f}" for swing in part) for part in parts)
            raise NoFitError(
                f"the swings at {before} s agree with each other, and so do those at "
                f"{' s, and those at '.join(after)} s, but not with them: was the closer or the "
                "linkage changed in between? Identify each from a recording of its own",
                quantity="root mean square of the residuals of all [rad]",
                value=_rmse(of_all), limit=limit, reason=CHANGED)
    if isinstance(fit, NoFitError):
        raise fit
    return CommonFit(fit, kept, out)


def _tried(
    linkage: FourBarCloser, swings: Sequence[FreeSwing], free: tuple[str, ...], zero_std: float,
    first: Mapping[str, float]
) -> RatioFit | NoFitError:
    """Return a fit, or the error that prevents it, since a bad swing can make a fit impossible."""
    try:
        return fit_ratios(linkage, swings, free, zero_std=zero_std, first=first)
    except NoFitError as error:
        return error


def _rmse(fit: RatioFit | NoFitError) -> float:
    """Return the root mean square of the residuals [rad]; infinite if there is no fit."""
    return math.inf if isinstance(fit, NoFitError) else fit.rmse


def warnings_about(left_out: Sequence[FreeSwing]) -> list[str]:
    """Return a warning about each swing that was left out."""
    return [
        f"the swing at {swing.t[0]:.1f} s ({math.degrees(float(swing.theta.max())):.1f} deg) was "
        "left out: it does not move as the others do; was the door touched, or the "
        "closer changed?"
        for swing in left_out
    ]
