"""Fit of free swings by eq. (6): ratios of the parameters and the start of each swing.

Eq. (6) minimises the squared differences between measured and simulated angles. The measured angles
are not differentiated, because a least squares on differentiated encoder angles is biased.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from scipy.integrate import cumulative_trapezoid

from door_model.door.closer import FourBarCloser
from door_model.door.ratios import Ratios
from door_model.errors import NoFitError
from door_model.identification.fit_guesses import first_guesses
from door_model.identification.parameters import is_angle
from door_model.identification.swing_problem import SwingProblem, Tolerances
from door_model.identification.swing_rows import stack
from door_model.recording.swings import FreeSwing

OPENING = ("opening", "spring", "preload", "play")
"""Unknowns that opening alone determines; it reaches beyond the peak, where play shows."""

SWING = ("opening", "closing", "spring", "preload", "play")
"""Unknowns that opening and closing determine."""

EXTRAS = {
    "friction": ("friction",), "backcheck": ("backcheck", "backcheck_angle"),
    "latch": ("latch", "latch_angle")}
"""Unknowns of what real closers add to the paper's door (module `door_model.door.door`)."""

_EXACT = Tolerances(1e-7, 1e-9, 30)
_ROUGH = Tolerances(1e-3, 1e-3, 15)  # for a fit that is refined later
_AS_GOOD = 2.0  # a rival fit is worse by at most this many standard deviations
_SAME = np.radians(0.5)  # zones closer to each other than this are the same [rad]
_ELSEWHERE = np.radians(2.0)  # a rival zone is at least this far away [rad]
_REFINED = 3  # largest number of rough fits that are refined
_WORTH = 1.5  # a rough fit is refined if its cost is below the best one's times this factor


@dataclass(frozen=True)
class RatioFit:
    """Fitted ratios.

    Attributes:
        free: Names of the fitted unknowns that the swings share (P,).
        values: Values of the unknowns (P,).
        covariance: Covariance of the unknowns (P, P).
        ratios: All ratios, including those that were not fitted.
        starts: Angle [rad] and angular velocity [rad/s] at the start of each swing (S, 2).
        fitted: Fitted angles of each swing, as the encoder shows them [rad].
        peaks: Largest angle of the leaf in each swing (S,) [rad].
        rmse: Root mean square of all residuals [rad].
        swing_rmse: Root mean square of the residuals of each swing (S,) [rad].
        rivals: Other angles of zones with which the swings fit as well, by name [rad].
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
        """Names of the unknowns without the zero, which is added if its spread is given."""
        return tuple(name for name in self.free if name != "zero")

    def value(self, name: str) -> float:
        """Return the value of an unknown; 0 if it was not fitted."""
        return float(self.values[self.free.index(name)]) if name in self.free else 0.0


def fit_ratios(
    closer: FourBarCloser, swings: Sequence[FreeSwing], free: tuple[str, ...] = SWING, *,
    zero_std: float = 0.0, first: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None
) -> RatioFit:
    """Fit the ratios to free swings, eq. (6).

    Args:
        closer: The closer's linkage.
        swings: The swings; only their opening is used if `closing` is not fitted.
        free: Names of the unknowns: `OPENING` or `SWING`, and unknowns of `EXTRAS`.
        zero_std: Standard deviation of the encoder's zero [rad], which is then fitted, too; 0 means
            that the zero is exact.
        first: First guesses of some unknowns, by name; the others are estimated from the swings.
        bounds: Lower and upper bounds of some ratios, by name; usually they are 0 and infinity.

    Raises:
        NoFitError: No first guess leads to a solution, or the found closer does not pull its door
            shut.
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
        free=free, values=x[: len(free)], covariance=np.asarray(pinv @ pinv.T * noise**2),
        ratios=problem.ratios(x), starts=problem.starts(x), fitted=fitted, peaks=peaks,
        rmse=float(np.sqrt(np.mean(np.concatenate(residuals) ** 2))),
        swing_rmse=np.array([np.sqrt(np.mean(block**2)) for block in residuals]),
        rivals=_rivals(problem, x, trials, noise))


def _solved(
    problem: SwingProblem, guesses: Sequence[Array], noise: float
) -> tuple[Array, list[Array]]:
    """Return the best solution from several first guesses, and the solutions of all guesses."""
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
    """Return the trials without those that have found the same zones as a better trial."""
    angles = [place for place, name in enumerate(free) if is_angle(name)]
    kept: list[Array] = []
    for trial in trials:
        if all(np.abs(trial[angles] - other[angles]).max(initial=0.0) > _SAME for other in kept):
            kept.append(trial)
    return kept


def _rivals(
    problem: SwingProblem, x: Array, trials: Sequence[Array], noise: float
) -> dict[str, float]:
    """Return angles of zones that lie elsewhere and fit within two standard deviations."""
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
    """Return the expected error of a swing's angles [rad]; 0 if it is not known."""
    return 0.0 if swing.errors is None else float(np.sqrt(np.mean(swing.errors**2)))


def _require_pull(closer: FourBarCloser, ratios: Ratios) -> None:
    """Check that a closer pulls its door shut.

    Raises:
        NoFitError: It does not.
    """
    f0, eta0 = closer.f_and_eta(0.0)
    pull = float(eta0 * (ratios.spring * f0 + ratios.preload))
    if not pull > 0.0:
        raise NoFitError(
            "the fitted closer does not pull the door shut: check the lengths of the linkage, and "
            "that the angle grows as the door opens",
            quantity="restoring torque of the closed door over I_A [1/s^2]",
            value=pull,
            limit=0.0,
        )


ESTIMATED = ("opening", "closing", "spring", "preload")
_SMALLEST = np.array([1e-3, 1e-3, 1e-3, -np.inf])  # least ratios; the preload may be negative


def first_estimate(
    closer: FourBarCloser, swings: Sequence[FreeSwing]
) -> tuple[dict[str, float], Array]:
    """Estimate ratios and starts from eq. (1) integrated twice over time, which is linear in them.

    Nothing is differentiated: the damper contributes the integral of eta^2 over the angle. Errors
    of the measured angles remain in the integrands, so the estimate is right to about a percent.

    Args:
        closer: The closer's linkage.
        swings: The swings (S,).

    Returns:
        Ratios by their names in `Ratios`, of which all but the preload are positive; and angle
        [rad] and angular velocity [rad/s] at the start of each swing (S, 2).
    """
    highest = max(float(swing.theta.max()) for swing in swings)
    angles = np.linspace(min(0.0, *(float(swing.theta.min()) for swing in swings)), highest, 2000)
    eta2 = closer.eta(angles) ** 2
    damped = cumulative_trapezoid(eta2, angles, initial=0.0)
    blocks = []
    for swing in swings:
        t = swing.t - swing.t[0]
        f, eta = closer.f_and_eta(swing.theta)
        passed = np.interp(swing.theta, angles, damped)
        peak = passed[swing.peak_index]
        closes = np.arange(len(t)) > swing.peak_index
        once = [np.where(closes, peak, passed) - passed[0], np.where(closes, passed - peak, 0.0)]
        twice = [cumulative_trapezoid(value, t, initial=0.0) for value in (eta * f, eta)]
        columns = [-cumulative_trapezoid(value, t, initial=0.0) for value in (*once, *twice)]
        blocks.append(np.column_stack([*columns, np.ones(len(t)), t, swing.theta]))
    rows = stack(blocks, len(ESTIMATED))
    answer = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)[0]
    ratios = np.maximum(answer[: len(ESTIMATED)], _SMALLEST)
    named = dict(zip(ESTIMATED, (float(ratio) for ratio in ratios), strict=True))
    return named, np.asarray(answer[len(ESTIMATED) :].reshape(-1, 2))
