"""Fit of free swings by eq. (6): ratios of the parameters and the start of each swing.

Eq. (6) sums the squared differences of measured and simulated angles; nothing is differentiated,
since a least squares on differentiated encoder angles is biased.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

from door_model.door.closer import FourBarCloser
from door_model.door.ratios import Ratios
from door_model.errors import NoFitError
from door_model.identification.first_estimate import first_estimate
from door_model.identification.fit_guesses import first_guesses
from door_model.identification.parameters import is_angle
from door_model.identification.swing_problem import SwingProblem, Tolerances
from door_model.recording.swings import FreeSwing

OPENING = ("opening", "spring", "preload", "play")
"""What opening alone tells, with the little beyond the peak where the play is taken up."""

SWING = ("opening", "closing", "spring", "preload", "play")
"""What opening and closing tell."""

EXTRAS = {
    "friction": ("friction",),
    "backcheck": ("backcheck", "backcheck_angle"),
    "latch": ("latch", "latch_angle"),
}
"""What real closers add, see `door_model.door.door`, by the names of what is fitted for it."""

_EXACT = Tolerances(1e-7, 1e-9, 30)
_ROUGH = Tolerances(1e-3, 1e-3, 15)  # where a better fit follows
_AS_GOOD = 2.0  # standard deviations
_SAME = np.radians(0.5)  # [rad] between zones
_ELSEWHERE = np.radians(2.0)  # [rad]
_REFINED = 3  # of many first guesses,
_WORTH = 1.5  # if their cost is below this times the best's


@dataclass(frozen=True)
class RatioFit:
    """Fitted ratios.

    Attributes:
        free: Names of the fitted unknowns that the swings share (P,).
        values: Their values (P,).
        covariance: (P, P) of the same.
        ratios: All ratios, those that were not fitted among them.
        starts: (S, 2) angle [rad] and velocity [rad/s] at the start of each swing.
        fitted: Fitted angles of each swing as the encoder shows them [rad].
        peaks: Largest angles of the leaf (S,) [rad].
        rmse: Of all residuals [rad].
        swing_rmse: (S,) of each swing [rad].
        rivals: Other angles of zones with which the swings fit as well [rad], by name.
    """

    free: tuple[str, ...]
    values: Array
    covariance: Array
    ratios: Ratios
    starts: Array
    fitted: list[Array]
    peaks: Array
    rmse: float
    swing_rmse: Array
    rivals: dict[str, float]

    @property
    def asked(self) -> tuple[str, ...]:
        """What was asked for: the zero is fitted besides where its spread is given."""
        return tuple(name for name in self.free if name != "zero")

    def value(self, name: str) -> float:
        """Value of one unknown; 0 where it was not fitted."""
        return float(self.values[self.free.index(name)]) if name in self.free else 0.0


def fit_ratios(
    closer: FourBarCloser,
    swings: Sequence[FreeSwing],
    free: tuple[str, ...] = SWING,
    *,
    zero_std: float = 0.0,
    first: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> RatioFit:
    """Fit the ratios to free swings, eq. (6).

    Args:
        closer: The linkage.
        swings: The swings; cut at their peaks where `closing` is not fitted.
        free: What to fit: `OPENING` or `SWING`, and names of `EXTRAS`.
        zero_std: Standard deviation of the encoder's zero, which is fitted too [rad]; 0: exact.
        first: First guesses of some of the unknowns, by name; the others' are made from the swings.
        bounds: Lower and upper bounds of some of the ratios; by default they are 0 and infinity.

    Raises:
        NoFitError: Every guess leads astray, or the door found does not pull itself shut.
    """
    if "closing" not in free:
        swings = [swing.opening() for swing in swings]
    if zero_std:
        free = (*free, "zero")
    problem = SwingProblem(closer, swings, free, zero_std, bounds or {})
    guess, starts = first_estimate(closer, swings)
    highest = max(float(swing.theta.max()) for swing in swings)
    guesses = [
        np.concatenate([shared, starts.ravel()])
        for shared in first_guesses(free, {**guess, **(first or {})}, highest)
    ]
    expected = float(np.mean([_expected_error(swing) for swing in swings])) or zero_std
    x, trials = _solved(problem, guesses, expected)
    residuals, noise = problem.spread(x)
    _require_pull(closer, problem.ratios(x))
    fitted, peaks = problem.fitted(x)
    pinv = np.linalg.pinv(problem.jacobian(x))[: len(free)]
    return RatioFit(
        free=free,
        values=x[: len(free)],
        covariance=np.asarray(pinv @ pinv.T * noise**2),
        ratios=problem.ratios(x),
        starts=problem.starts(x),
        fitted=fitted,
        peaks=peaks,
        rmse=float(np.sqrt(np.mean(np.concatenate(residuals) ** 2))),
        swing_rmse=np.array([np.sqrt(np.mean(block**2)) for block in residuals]),
        rivals=_rivals(problem, x, trials, noise),
    )


def _solved(
    problem: SwingProblem, guesses: Sequence[Array], noise: float
) -> tuple[Array, list[Array]]:
    """Best solution from some first guesses, and where each of them led."""
    once = len(guesses) == 1 and not problem.zero_std
    trials: list[Array] = []
    failure = None
    for guess in guesses:
        try:
            trials.append(problem.solve(guess, noise, _EXACT if once else _ROUGH))
        except NoFitError as error:
            failure = error
    if failure is not None and not trials:
        raise failure
    trials.sort(key=problem.cost)
    if once:
        return trials[0], trials
    least = _WORTH * problem.cost(trials[0])
    best = [trial for trial in _apart(trials, problem.free)[:_REFINED]
            if problem.cost(trial) <= least]
    noise = problem.spread(best[0])[1]
    return min((problem.solve(trial, noise, _EXACT) for trial in best), key=problem.cost), trials


def _apart(trials: Sequence[Array], free: tuple[str, ...]) -> list[Array]:
    """Those of some trials that have not found the same zones as one before them."""
    angles = [place for place, name in enumerate(free) if is_angle(name)]
    kept: list[Array] = []
    for trial in trials:
        if all(np.abs(trial[angles] - other[angles]).max(initial=0.0) > _SAME for other in kept):
            kept.append(trial)
    return kept


def _rivals(
    problem: SwingProblem, x: Array, trials: Sequence[Array], noise: float
) -> dict[str, float]:
    """Angles of zones in trials that lie elsewhere and fit within two standard deviations."""
    as_good = [
        trial for trial in trials
        if problem.cost(trial) - problem.cost(x) < (_AS_GOOD * noise) ** 2
    ]
    return {
        name: float(trial[place])
        for place, name in enumerate(problem.free) if is_angle(name)
        for trial in as_good if abs(trial[place] - x[place]) > _ELSEWHERE
    }


def _expected_error(swing: FreeSwing) -> float:
    """Expected error of a swing's angles [rad]; 0 where it is not known."""
    return 0.0 if swing.errors is None else float(np.sqrt(np.mean(swing.errors**2)))


def _require_pull(closer: FourBarCloser, ratios: Ratios) -> None:
    """Raise NoFitError where a closer does not pull its door shut."""
    f0, eta0 = closer.f_and_eta(0.0)
    pull = float(eta0 * (ratios.spring * f0 + ratios.preload))
    if not pull > 0.0:
        raise NoFitError(
            "the fitted closer does not pull the door shut; is the linkage right, and does the "
            "angle grow as the door opens?",
            value=pull,
            limit=0.0,
        )
