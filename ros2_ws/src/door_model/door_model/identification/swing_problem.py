"""The least squares of eq. (6) over several swings, with exact derivatives.

All swings share some unknowns: ratios, with their names in `Ratios`, and two properties of the
encoder. ``play`` [rad] is the free travel between the leaf and the encoder. The encoder's zero
belongs to a door that has just closed, so the opening leaf is ahead of the encoder by the play; the
leaf travels through the play again after the peak. ``zero`` [rad] is the angle that the encoder
shows at the closed door; it is known beforehand to be near 0.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from scipy.optimize import least_squares

from door_model.door.closer import FourBarCloser
from door_model.door.ratios import Ratios
from door_model.errors import DoorModelError, NoFitError
from door_model.identification.fit_guesses import fit_bounds
from door_model.identification.swing_rows import stack
from door_model.motion.free_motion import UNKNOWNS, FreeMotion, follow
from door_model.recording.swings import FreeSwing

# Each of these ratios equals the other one if it is not fitted.
_TIES = {"closing": "opening", "backcheck": "opening", "latch": "closing"}
_LAGS = 200  # largest number of samples over which residuals may be correlated
_MARGIN = 1e-3  # time after the last sample for which the motion is followed [s]


class Tolerances(NamedTuple):
    """When the solver stops.

    Attributes:
        unknowns: Relative change of the unknowns.
        cost: Relative change of the cost.
        most: Largest number of evaluations.
    """

    unknowns: float
    cost: float
    most: int


class SwingProblem:
    """Residuals of eq. (6) and their Jacobian, all swings integrated at once."""

    def __init__(
        self, closer: FourBarCloser, swings: Sequence[FreeSwing], free: tuple[str, ...],
        zero_std: float, bounds: Mapping[str, tuple[float, float]]
    ) -> None:
        """Set the swings, the unknowns and their bounds, as in `trajectory_fit.fit_ratios`."""
        self.closer = closer
        self.free = free
        self.zero_std = zero_std
        self.times = [swing.t - swing.t[0] for swing in swings]
        self.measured = [swing.theta for swing in swings]
        self.weights = [swing.weights for swing in swings]
        self.durations = np.array([t[-1] for t in self.times])
        self.limits = fit_bounds(free, swings, bounds)
        self._zero_weight = 0.0  # weight of the row of the zero
        self._at: Array | None = None
        self._rows = np.empty((0, 0))

    def ratios(self, x: Array) -> Ratios:
        """Return all ratios for a vector of unknowns."""
        known = dict(zip(self.free, x, strict=False))
        names = [field.name for field in fields(Ratios)]
        for name, other in _TIES.items():
            known.setdefault(name, known[other])
        return Ratios(**{name: known[name] for name in names if name in known})

    def starts(self, x: Array) -> Array:
        """Return angle [rad] and velocity [rad/s] of the starts (S, 2) for a vector of unknowns."""
        return x[len(self.free) :].reshape(-1, 2)

    def fitted(self, x: Array) -> tuple[list[Array], Array]:
        """Return the angles of each swing as the encoder shows them, and the peaks (S,) [rad]."""
        motion = self._follow(x)
        seen = [self._seen(motion, i, x)[0] for i in range(len(self.times))]
        highest = np.array([angles.max() for angles in seen])
        return seen, np.where(np.isnan(motion.peak_angle), highest, motion.peak_angle)

    def _seen(self, motion: FreeMotion, swing: int, x: Array) -> tuple[Array, Array, Array]:
        """Return a swing as the encoder shows it.

        Returns:
            Angles at the samples (M,) [rad], and their derivatives by the shared unknowns (M, P)
            and by the start (M, 2).
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
        """Return the motions of all swings for a vector of unknowns."""
        return follow(
            self.closer.numbers(), self.ratios(x), *self.starts(x).T,
            until=self.durations + _MARGIN, exact=True)

    def residuals(self, x: Array) -> Array:
        """Return simulated minus measured angles, rotated as in `rows`."""
        return self.rows(x)[:, -1]

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives of `residuals`."""
        return self.rows(x)[:, :-1]

    def rows(self, x: Array) -> Array:
        """Return the rotated rows of Jacobian and residual; the last row keeps the zero near 0."""
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
            last[0, [column, -1]] = self._zero_weight * np.array([1.0, x[column]])
            rows = np.vstack([rows, last])
        self._at, self._rows = np.array(x), rows
        return rows

    def solve(self, x: Array, noise: float, tolerances: Tolerances) -> Array:
        """Solve the least squares from a first guess.

        Args:
            x: The first guess.
            noise: Standard deviation of a residual as an independent measurement [rad], which
                sets the weight of the zero.
            tolerances: When the solver stops.

        Raises:
            NoFitError: The solver tries a door whose motion cannot be followed.
        """
        self._zero_weight = noise / self.zero_std if self.zero_std else 0.0
        self._at = None
        try:
            solution = least_squares(
                self.residuals, np.clip(x, *self.limits), jac=self.jacobian, bounds=self.limits,
                x_scale="jac", xtol=tolerances.unknowns, ftol=tolerances.cost, gtol=1e-12,
                max_nfev=tolerances.most)
        except DoorModelError as error:
            raise NoFitError(
                f"the fit has reached a door whose motion cannot be followed: {error}",
                quantity=error.quantity, value=error.value, limit=error.limit) from error
        return np.asarray(solution.x)

    def cost(self, x: Array) -> float:
        """Return the sum of the squared residuals [rad^2]."""
        return float(np.sum(self.residuals(x) ** 2))

    def spread(self, x: Array) -> tuple[list[Array], float]:
        """Return the residuals of each swing, and their spread.

        The variance of the residuals is increased by their autocorrelation, because quantisation
        errors of a slow door repeat from sample to sample.

        Returns:
            Residuals of each swing [rad], and the standard deviation of a residual as an
            independent measurement [rad].
        """
        fitted, _ = self.fitted(x)
        residuals = [model - data for model, data in zip(fitted, self.measured, strict=True)]
        weighted = [rest * weight for rest, weight in zip(residuals, self.weights, strict=True)]
        squares = sum(float(block @ block) for block in weighted)
        count = sum(len(block) for block in weighted)
        variance = squares / max(1, count - len(x))
        return residuals, float(np.sqrt(variance * _autocorrelation_factor(weighted, squares)))


def _autocorrelation_factor(residuals: Sequence[Array], squares: float) -> float:
    """Return 1 + 2 * sum of the residuals' autocorrelation up to its first zero, at least 1."""
    factor = 1.0
    if squares <= 0.0:
        return factor
    for lag in range(1, _LAGS + 1):
        products = sum(float(b[:-lag] @ b[lag:]) for b in residuals if len(b) > lag)
        if products <= 0.0:
            break
        factor += 2.0 * products / squares
    return factor
