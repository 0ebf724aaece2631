"""First estimate of a door's ratios from its swings, by a linear least squares."""

from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array
from scipy.integrate import cumulative_trapezoid

from door_model.door.closer import FourBarCloser
from door_model.identification.swing_rows import stack
from door_model.recording.swings import FreeSwing

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
