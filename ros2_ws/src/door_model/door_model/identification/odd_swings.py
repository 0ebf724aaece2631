"""A fit that leaves out the swings that do not move as the others do."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from door_model.door.closer import FourBarCloser
from door_model.errors import NoFitError
from door_model.identification.trajectory_fit import RatioFit, fit_ratios
from door_model.recording.swings import FreeSwing

_GAIN = 0.5  # a swing is left out where that brings the rmse below this share
_MOST_TRIED = 12
_LEAST_LEFT = 3  # of fewer none can be told to be the odd one
_MOST_OUT = 1.0 / 3.0  # of the swings


@dataclass(frozen=True)
class CommonFit:
    """A fit and the swings that it is of.

    Attributes:
        fit: The fit.
        swings: Its swings.
        left_out: Those that move otherwise.
    """

    fit: RatioFit
    swings: list[FreeSwing]
    left_out: list[FreeSwing]


def fit_common(
    linkage: FourBarCloser,
    swings: Sequence[FreeSwing],
    free: tuple[str, ...],
    *,
    zero_std: float,
    good_rmse: float,
    first: Mapping[str, float] | None = None,
) -> CommonFit:
    """Fit the ratios to those swings that agree with each other.

    One bad swing pulls the fit of all with it, so each is tried without.

    Args:
        linkage: The linkage.
        swings: The swings.
        free: What to fit, see `fit_ratios`.
        zero_std: Of the encoder's zero [rad].
        good_rmse: A fit this good hides no odd swing [rad].
        first: First guesses, see `fit_ratios`.

    Raises:
        NoFitError: As `fit_ratios`.
    """
    kept = list(swings)
    out: list[FreeSwing] = []
    known = dict(first or {})
    fit = _tried(linkage, kept, free, zero_std, known)
    while _rmse(fit) > good_rmse and len(kept) > _LEAST_LEFT and (
        len(out) + 1 <= _MOST_OUT * len(swings)
    ):
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
    if isinstance(fit, NoFitError):
        raise fit
    return CommonFit(fit, kept, out)


def _tried(
    linkage: FourBarCloser,
    swings: Sequence[FreeSwing],
    free: tuple[str, ...],
    zero_std: float,
    first: Mapping[str, float],
) -> RatioFit | NoFitError:
    """A fit, or why there is none: one bad swing may keep all from being fitted."""
    try:
        return fit_ratios(linkage, swings, free, zero_std=zero_std, first=first)
    except NoFitError as error:
        return error


def _rmse(fit: RatioFit | NoFitError) -> float:
    """Root mean square of the residuals [rad], infinite where there is no fit."""
    return math.inf if isinstance(fit, NoFitError) else fit.rmse


def said_of(left_out: Sequence[FreeSwing]) -> list[str]:
    """What to say of swings that were left out."""
    return [
        f"the swing at {swing.t[0]:.1f} s ({math.degrees(float(swing.theta.max())):.1f} deg) was "
        "left out: it does not move as the others do; was the door touched?"
        for swing in left_out
    ]
