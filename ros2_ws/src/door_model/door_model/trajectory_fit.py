"""Fit of free swings by eq. (6): ratios of the parameters and the start of each swing.

Eq. (6) sums the squared differences of measured and simulated angles; nothing is differentiated,
since a least squares on differentiated encoder angles is biased.

All swings share some unknowns: ratios by their names in `Ratios`, and two of the encoder. Its
``play`` [rad] lies between it and the leaf: its zero is that of a door just closed, so that the
opening leaf is ahead of it by the play, which is taken up again behind the peak. Its ``zero`` [rad]
is what it shows at the closed door, known beforehand to be near 0.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.optimize import least_squares

from door_model.closer import FourBarCloser
from door_model.errors import DoorModelError, NoFitError
from door_model.first_estimate import first_estimate
from door_model.fit_guesses import first_guesses, fit_bounds
from door_model.free_motion import UNKNOWNS, FreeMotion, Ratios, follow
from door_model.swing_rows import Array, stack
from door_model.swings import FreeSwing

OPENING = ("opening", "spring", "preload", "play")
"""What opening alone tells, with the little beyond the peak where the play is taken up."""

SWING = ("opening", "closing", "spring", "preload", "play")
"""What opening and closing tell."""

EXTRAS = {
    "friction": ("friction",),
    "backcheck": ("backcheck", "backcheck_angle"),
    "latch": ("latch", "latch_angle"),
}
"""What real closers add, see `door_model.door`, by the names of what is fitted for it."""

_TIES = {"closing": "opening", "backcheck": "opening", "latch": "closing"}  # what is not fitted
_LAGS = 200  # samples over which residuals may hang together
_EXACT = 1e-7, 1e-9, 30  # tolerances of the unknowns and of the cost; evaluations at most
_ROUGH = 1e-3, 1e-3, 15  # where a better fit follows
_AS_GOOD = 2.0  # standard deviations
_SAME = np.radians(0.5)  # [rad] between zones
_ELSEWHERE = np.radians(2.0)  # [rad]
_REFINED = 3  # of many first guesses,
_WORTH = 1.5  # if their cost is below this times the best's
_MARGIN = 1e-3  # [s]; the last sample lies inside the motion


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

    def value(self, name: str) -> float:
        """Value of one unknown; 0 where it was not fitted."""
        return float(self.values[self.free.index(name)]) if name in self.free else 0.0


class _Problem:
    """Residuals of eq. (6) and their Jacobian, all swings integrated at once."""

    def __init__(
        self, closer: FourBarCloser, swings: Sequence[FreeSwing], free: tuple[str, ...]
    ) -> None:
        self.closer = closer
        self.free = free
        self.times = [swing.t - swing.t[0] for swing in swings]
        self.measured = [swing.theta for swing in swings]
        self.weights = [swing.weights for swing in swings]
        self.durations = np.array([t[-1] for t in self.times])
        self.zero_weight = 0.0  # of what is known of the zero, beside one sample
        self._at: Array | None = None
        self._rows = np.empty((0, 0))

    def ratios(self, x: Array) -> Ratios:
        """All ratios of a vector of unknowns."""
        known = dict(zip(self.free, x, strict=False))
        names = [field.name for field in fields(Ratios)]
        for name, other in _TIES.items():
            known.setdefault(name, known[other])
        return Ratios(**{name: known[name] for name in names if name in known})

    def starts(self, x: Array) -> Array:
        """Starts (S, 2) of a vector of unknowns."""
        return x[len(self.free) :].reshape(-1, 2)

    def fitted(self, x: Array) -> tuple[list[Array], Array]:
        """Angles of every swing at its samples, as the encoder shows them, and peaks (S,)."""
        motion = self._follow(x)
        seen = [self._seen(motion, i, x)[0] for i in range(len(self.times))]
        highest = np.array([angles.max() for angles in seen])
        return seen, np.where(np.isnan(motion.peak_angle), highest, motion.peak_angle)

    def _seen(self, motion: FreeMotion, swing: int, x: Array) -> tuple[Array, Array, Array]:
        """A swing through the encoder.

        Returns:
            Angles at the samples, their slopes by the shared unknowns (M, P) and by the start
            (M, 2).
        """
        t, top_time = self.times[swing], motion.peak_time[swing]
        theta, by_motion = motion.derivatives(swing, t)
        known = dict(zip(self.free, x, strict=False))
        by_play = np.zeros(len(t))
        if "play" in known:
            (top,), top_slopes = motion.derivatives(swing, np.array([top_time]))
            falls = t > top_time
            follows = falls & (theta <= top - known["play"])
            rests = falls & ~follows
            by_motion[rests] = top_slopes
            theta = np.where(follows, theta, np.where(rests, top, theta) - known["play"])
            by_play = np.where(follows, 0.0, -1.0)
        theta = theta + known.get("zero", 0.0)
        by_name = dict(zip(UNKNOWNS, by_motion.T, strict=True))
        for name, other in reversed(_TIES.items()):
            if name not in known:
                by_name[other] = by_name[other] + by_name[name]
        by_name |= {"play": by_play, "zero": np.ones(len(t))}
        return theta, np.column_stack([by_name[name] for name in self.free]), by_motion[:, -2:]

    def _follow(self, x: Array) -> FreeMotion:
        """The swings as a vector of unknowns has them."""
        return follow(
            self.closer.numbers(), self.ratios(x), *self.starts(x).T,
            until=self.durations + _MARGIN, exact=True)

    def residuals(self, x: Array) -> Array:
        """Simulated minus measured angles, rotated."""
        return self.rows(x)[:, -1]

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the same rows."""
        return self.rows(x)[:, :-1]

    def rows(self, x: Array) -> Array:
        """Rotated rows of [Jacobian, residual], the last what is known of the zero."""
        if self._at is not None and np.array_equal(x, self._at):
            return self._rows
        motion = self._follow(x)
        blocks = []
        for i, measured in enumerate(self.measured):
            theta, shared, own = self._seen(motion, i, x)
            rows = np.column_stack([shared, own, theta - measured])
            blocks.append(rows * self.weights[i][:, None])
        rows = stack(blocks, len(self.free))
        if "zero" in self.free:
            column = self.free.index("zero")
            last = np.zeros((1, rows.shape[1]))
            last[0, [column, -1]] = self.zero_weight * np.array([1.0, x[column]])
            rows = np.vstack([rows, last])
        self._at, self._rows = np.array(x), rows
        return rows

    def solve(
        self, x: Array, noise: float, zero_std: float, bounds: tuple[Array, Array],
        tolerances: tuple[float, float, int],
    ) -> Array:
        """Least squares from a first guess, with what is known of the zero beside the noise."""
        self.zero_weight = noise / zero_std if zero_std else 0.0
        self._at = None
        xtol, ftol, most = tolerances
        try:
            solution = least_squares(
                self.residuals, np.clip(x, *bounds), jac=self.jacobian, bounds=bounds,
                x_scale="jac", xtol=xtol, ftol=ftol, gtol=1e-12, max_nfev=most)
        except DoorModelError as error:
            raise NoFitError(f"the fit went astray: {error}", value=error.value) from error
        return np.asarray(solution.x)

    def cost(self, x: Array) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residuals(x) ** 2))

    def spread(self, x: Array) -> tuple[list[Array], float]:
        """Residuals of each swing, and what one of them counts as a measurement of its own [rad].

        Their variance is inflated by their autocorrelation: quantisation errors of a slow door
        repeat from sample to sample.
        """
        fitted, _ = self.fitted(x)
        residuals = [model - data for model, data in zip(fitted, self.measured, strict=True)]
        weighted = [rest * weight for rest, weight in zip(residuals, self.weights, strict=True)]
        squares = sum(float(block @ block) for block in weighted)
        count = sum(len(block) for block in weighted)
        variance = squares / max(1, count - len(x))
        return residuals, float(np.sqrt(variance * _autocorrelation_factor(weighted, squares)))


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
        NoFitError: The fit does not converge, or the door found does not pull itself shut.
    """
    if "closing" not in free:
        swings = [swing.opening() for swing in swings]
    if zero_std:
        free = (*free, "zero")
    problem = _Problem(closer, swings, free)
    guess, starts = first_estimate(closer, swings)
    highest = max(float(swing.theta.max()) for swing in swings)
    limits = fit_bounds(free, swings, bounds or {})
    expected = float(np.mean([_expected_error(swing) for swing in swings])) or zero_std
    guesses = first_guesses(free, {**guess, **(first or {})}, highest)
    once = len(guesses) == 1 and not zero_std
    trials = [
        problem.solve(np.concatenate([shared, starts.ravel()]), expected, zero_std, limits,
                      _EXACT if once else _ROUGH)
        for shared in guesses
    ]
    trials.sort(key=problem.cost)
    best = _apart(trials, free)[:_REFINED]
    best = [trial for trial in best if problem.cost(trial) <= _WORTH * problem.cost(best[0])]
    if not once:
        noise = problem.spread(best[0])[1]
        best = [problem.solve(trial, noise, zero_std, limits, _EXACT) for trial in best]
    x = min(best, key=problem.cost)
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


def _apart(trials: Sequence[Array], free: tuple[str, ...]) -> list[Array]:
    """Those of some trials that have not found the same zones as one before them."""
    angles = [place for place, name in enumerate(free) if name.endswith("_angle")]
    kept: list[Array] = []
    for trial in trials:
        if all(np.abs(trial[angles] - other[angles]).max(initial=0.0) > _SAME for other in kept):
            kept.append(trial)
    return kept


def _rivals(problem: _Problem, x: Array, trials: Sequence[Array], noise: float) -> dict[str, float]:
    """Angles of zones in trials that lie elsewhere and fit within two standard deviations."""
    as_good = [
        trial for trial in trials
        if problem.cost(trial) - problem.cost(x) < (_AS_GOOD * noise) ** 2
    ]
    return {
        name: float(trial[place])
        for place, name in enumerate(problem.free) if name.endswith("_angle")
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


def _autocorrelation_factor(residuals: Sequence[Array], squares: float) -> float:
    """1 + 2 * sum of the residuals' autocorrelation up to its first zero, at least 1."""
    factor = 1.0
    if squares <= 0.0:
        return factor
    for lag in range(1, _LAGS + 1):
        products = sum(float(b[:-lag] @ b[lag:]) for b in residuals if len(b) > lag)
        if products <= 0.0:
            break
        factor += 2.0 * products / squares
    return factor
