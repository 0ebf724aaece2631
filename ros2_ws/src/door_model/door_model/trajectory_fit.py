"""Fit of free swings by eq. (6): ratios of the parameters and the start of each swing.

Eq. (6) sums the squared differences of measured and simulated angles; nothing is differentiated,
since a least squares on differentiated encoder angles is biased.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import least_squares

from door_model.closer import FourBarCloser
from door_model.errors import NoFitError
from door_model.free_motion import UNKNOWNS, FreeMotion, Ratios, follow
from door_model.swings import FreeSwing

Array = NDArray[np.float64]

RATIO_NAMES = ("opening", "closing", "spring", "preload")
_SMALLEST = np.array([1e-3, 1e-3, 1e-3, 1e-2])  # of a first guess of the ratios
_LAGS = 200  # samples over which residuals may hang together
_PIECE = 64  # rows
MOST_PLAY = np.radians(2.0)  # [rad]; more is a loose coupling
_MARGIN = 1e-3  # [s]; the last sample lies inside the motion


@dataclass(frozen=True)
class RatioFit:
    """Fitted ratios.

    Attributes:
        ratios: (4,) c_c (opening), c_c (closing), k_c and tau'_c0 over I_A. Where only opening
            was fitted the second equals the first.
        covariance: (4, 4) of the ratios.
        starts: (S, 2) angle [rad] and velocity [rad/s] at the start of each swing.
        play: Between the leaf and its encoder [rad], where there is none a little to either side
            of 0; 0 where only opening was fitted, which cannot tell it from an error of the zero.
        play_std: Its standard deviation [rad].
        fitted: Fitted angles of each swing as the encoder shows them [rad].
        peaks: Largest angles of the leaf (S,) [rad].
        rmse: Of all residuals [rad].
        swing_rmse: (S,) of each swing [rad].
    """

    ratios: Array
    covariance: Array
    starts: Array
    play: float
    play_std: float
    fitted: list[Array]
    peaks: Array
    rmse: float
    swing_rmse: Array


def first_estimate(closer: FourBarCloser, swings: Sequence[FreeSwing]) -> tuple[Array, Array]:
    """Ratios and starts by a linear least squares on eq. (1) integrated twice over time.

    Nothing is differentiated: the damper's share is the integral of eta^2 over the angle. What is
    left of the measurement's errors in the integrands makes it good to about a percent.

    Returns:
        Ratios (4,) and starts (S, 2), as `RatioFit` has them.
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
    rows = _stack(blocks, 4)
    answer = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)[0]
    return np.asarray(answer[:4]), np.asarray(answer[4:].reshape(-1, 2))


def _stack(blocks: Sequence[Array], shared: int) -> Array:
    """Rows of all swings from [columns of shared unknowns, of two of its own, others] of each.

    Each swing's rows are rotated down to a few (`_triangle`) before they are put together.

    Returns:
        Rows of [shared, two for each swing, others].
    """
    others = blocks[0].shape[1] - shared - 2
    stack = []
    for number, block in enumerate(blocks):
        small = _triangle(block)
        rows = np.zeros((len(small), shared + 2 * len(blocks) + others))
        rows[:, :shared] = small[:, :shared]
        own = shared + 2 * number
        rows[:, own : own + 2] = small[:, shared : shared + 2]
        rows[:, -others:] = small[:, shared + 2 :]
        stack.append(rows)
    return np.vstack(stack)


class _Problem:
    """Residuals of eq. (6) and their Jacobian, all swings integrated at once.

    A swing depends on the shared ratios and on its own start alone. So each swing's rows are
    rotated down to a few (`_stack`): what the solver sees has the same costs, gradients and normal
    equations, and 40 rows for five swings in place of 12,000.
    """

    def __init__(
        self, closer: FourBarCloser, swings: Sequence[FreeSwing], with_closing: bool
    ) -> None:
        self.closer = closer
        self.with_closing = with_closing
        self.times = [swing.t - swing.t[0] for swing in swings]
        self.measured = [swing.theta for swing in swings]
        self.weights = [swing.weights for swing in swings]
        self.durations = np.array([t[-1] for t in self.times])
        self.ratios = 4 if with_closing else 3
        self.shared = 5 if with_closing else 3  # with the play
        self._at: Array | None = None
        self._rows = np.empty((0, 0))

    def expand(self, x: Array) -> tuple[Array, float, Array]:
        """Ratios (4,), play and starts (S, 2) of a vector of unknowns."""
        ratios, play = (x[:4], float(x[4])) if self.with_closing else (x[[0, 0, 1, 2]], 0.0)
        return ratios, play, x[self.shared :].reshape(-1, 2)

    def fitted(self, x: Array) -> tuple[list[Array], Array]:
        """Angles of every swing at its samples, as the encoder shows them, and peaks (S,)."""
        motion = self._follow(x)
        seen = [self._seen(motion, i, self.expand(x)[1])[0] for i in range(len(self.times))]
        highest = np.array([angles.max() for angles in seen])
        return seen, np.where(np.isnan(motion.peak_angle), highest, motion.peak_angle)

    def _seen(self, motion: FreeMotion, swing: int, play: float) -> tuple[Array, Array, Array]:
        """A swing through the encoder's play.

        The encoder's zero is that of the door that has just closed: opening, the leaf is ahead of
        it by the play, which is taken up again behind the peak.

        Returns:
            Angles at the samples, their slopes by `UNKNOWNS` (M, U) and by the play (M,).
        """
        t, top_time = self.times[swing], motion.peak_time[swing]
        theta, slopes = motion.derivatives(swing, t)
        if not self.with_closing:
            return theta, slopes, np.zeros(len(t))
        (top,), top_slopes = motion.derivatives(swing, np.array([top_time]))
        falls = t > top_time
        follows = falls & (theta <= top - play)
        rests = falls & ~follows
        slopes[rests] = top_slopes
        seen = np.where(follows, theta, np.where(rests, top, theta) - play)
        return seen, slopes, np.where(follows, 0.0, -1.0)

    def _follow(self, x: Array) -> FreeMotion:
        """The swings as a vector of unknowns has them."""
        (opening, closing, spring, preload), _, starts = self.expand(x)
        ratios = Ratios(opening, closing, opening, closing, spring, preload)
        return follow(
            self.closer.numbers(), ratios, *starts.T, until=self.durations + _MARGIN, exact=True)

    def residuals(self, x: Array) -> Array:
        """Simulated minus measured angles, rotated."""
        return self.rows(x)[:, -2]

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the same rows."""
        return self.rows(x)[:, :-2]

    def rows(self, x: Array) -> Array:
        """Rotated rows of [Jacobian, residual, 1]."""
        if self._at is not None and np.array_equal(x, self._at):
            return self._rows
        motion = self._follow(x)
        blocks = []
        for i, measured in enumerate(self.measured):
            theta, slopes, by_play = self._seen(motion, i, self.expand(x)[1])
            columns = [slopes[:, UNKNOWNS.index(name)] for name in RATIO_NAMES]
            columns = [*columns, by_play] if self.with_closing else [
                columns[0] + columns[1], *columns[2:]]
            rows = np.column_stack(
                [*columns, slopes[:, -2:], theta - measured, np.ones(len(theta))])
            blocks.append(rows * self.weights[i][:, None])
        self._at, self._rows = np.array(x), _stack(blocks, self.shared)
        return self._rows


def _triangle(rows: Array) -> Array:
    """Triangular matrix with the same products of columns as a tall one.

    By the QR decomposition of many short pieces: one of the whole would start the threads of
    the linear algebra library, which is slow where the cores are busy with a simulation.
    """
    columns = rows.shape[1]
    while len(rows) > _PIECE:
        pieces = -(-len(rows) // _PIECE)
        padded = np.zeros((pieces * _PIECE, columns))
        padded[: len(rows)] = rows
        stack = np.linalg.qr(padded.reshape(pieces, _PIECE, columns), mode="r")
        rows = np.asarray(stack).reshape(-1, columns)
    return np.asarray(np.linalg.qr(rows, mode="r"))


def fit_ratios(
    closer: FourBarCloser,
    swings: Sequence[FreeSwing],
    *,
    with_closing: bool,
    zero_std: float = 0.0,
    first: RatioFit | None = None,
) -> RatioFit:
    """Fit the ratios to free swings, eq. (6).

    Args:
        closer: The linkage.
        swings: The swings.
        with_closing: Fit closing as well, with a viscosity of its own; else cut at the peaks.
        zero_std: Standard deviation of the encoder's zero, which all swings share [rad].
        first: A fit of the same swings to start from.

    Raises:
        NoFitError: The fit does not converge, or the door found does not pull itself shut.
    """
    if not with_closing:
        swings = [swing.opening() for swing in swings]
    problem = _Problem(closer, swings, with_closing)
    if first is None:
        ratios0, starts0 = first_estimate(closer, swings)
    else:
        ratios0, starts0 = first.ratios, first.starts
    ratios0 = np.maximum(ratios0, _SMALLEST)
    shared0 = [*ratios0, 0.0] if with_closing else ratios0[[0, 2, 3]]
    x0 = np.concatenate([shared0, starts0.ravel()])
    lower, upper = np.full_like(x0, -np.inf), np.full_like(x0, np.inf)
    lower[: problem.ratios] = 0.0
    # Not bounded by 0, where a fit to noise may lie on either side of it.
    lower[problem.ratios : problem.shared] = -MOST_PLAY
    upper[problem.ratios : problem.shared] = MOST_PLAY
    solution = least_squares(
        problem.residuals,
        x0,
        jac=problem.jacobian,
        bounds=(lower, upper),
        x_scale="jac",
        xtol=1e-7,
        ftol=1e-9,
        gtol=1e-12,
        max_nfev=100,
    )
    if not solution.success:
        raise NoFitError(f"the fit did not converge: {solution.message}", value=solution.cost)
    ratios, play, starts = problem.expand(solution.x)
    f0, eta0 = closer.f_and_eta(0.0)
    pull = float(eta0 * (ratios[2] * f0 + ratios[3]))
    if not pull > 0.0:
        raise NoFitError(
            "the fitted closer does not pull the door shut; is the linkage right, and does the "
            "angle grow as the door opens?",
            value=pull,
            limit=0.0,
        )
    fitted, peaks = problem.fitted(solution.x)
    residuals = [model - data for model, data in zip(fitted, problem.measured, strict=True)]
    weighted = [rest * weight for rest, weight in zip(residuals, problem.weights, strict=True)]
    covariance = _covariance(problem.rows(solution.x), weighted, zero_std)
    play_std = float(np.sqrt(covariance[4, 4])) if with_closing else 0.0
    covariance = covariance[: problem.ratios, : problem.ratios]
    if not with_closing:
        covariance = covariance[np.ix_([0, 0, 1, 2], [0, 0, 1, 2])]
    return RatioFit(
        ratios=ratios,
        covariance=covariance,
        starts=starts,
        play=play,
        play_std=play_std,
        fitted=fitted,
        peaks=peaks,
        rmse=float(np.sqrt(np.mean(np.concatenate(residuals) ** 2))),
        swing_rmse=np.array([np.sqrt(np.mean(block**2)) for block in residuals]),
    )


def _covariance(rows: Array, residuals: Sequence[Array], zero_std: float) -> Array:
    """Covariance of the unknowns.

    The variance of the residuals is inflated by their autocorrelation: quantisation errors of a
    slow door repeat from sample to sample. An error of the zero, common to all samples, adds its
    own share.

    Args:
        rows: Of [Jacobian, residual, 1], see `_Problem.rows`.
        residuals: Of each swing [rad].
        zero_std: Standard deviation of the zero [rad].
    """
    jacobian = rows[:, :-2]
    count = sum(len(block) for block in residuals)
    squares = sum(float(block @ block) for block in residuals)
    variance = squares / max(1, count - jacobian.shape[1])
    pinv = np.linalg.pinv(jacobian)
    covariance = pinv @ pinv.T * variance * _autocorrelation_factor(residuals, squares)
    shift = pinv @ rows[:, -1] * zero_std
    return np.asarray(covariance + np.outer(shift, shift))


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
