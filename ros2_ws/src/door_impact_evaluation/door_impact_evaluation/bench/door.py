"""Measures how fast doors are identified and simulated; the peer is scipy, one door at a time."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_model.door.closer import FourBarCloser, four_bar
from door_model.door.config import load_door
from door_model.door.ratios import Ratios
from door_model.identification.trajectory_fit import fit_ratios
from door_model.motion.free_motion import follow
from door_model.recording.recording import from_counts
from door_model.recording.swings import FreeSwing, find_swings
from door_model.recording.synthetic import five_swings, quantise, simulate_pushes
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from door_impact_evaluation.errors import BenchError

_PEAKS_DEG = (9.0, 13.0, 17.0, 21.0, 25.0)  # largest angles of the swings [deg]
_SAMPLES = 1500   # samples of each swing, at 1 kHz
_DOORS = 1000     # doors that are simulated together
_PEERS = 50       # doors that the peer simulates; its time for all doors is scaled from these
_RTOL = 1e-8      # tolerance of the peer's integrator
_SAME = 1e-3      # largest relative difference between the two results
_REPEATS = 5      # runs, of which the fastest counts
_GUESS_OFF = 1.2  # ratio of the peer's first guess to the true values; our fit finds its own guess


def identify_five_swings() -> tuple[float, float]:
    """Measures the fit by eq. (6) of five swings of 1,500 samples.

    Returns:
        Wall time of our fit, and of `solve_ivp` inside `least_squares` with finite differences
        [ms].

    Raises:
        BenchError: The two find different doors.
    """
    closer, swings = load_door("paper").linkage, _swings(_PEAKS_DEG)
    ours, fit = _best(lambda: fit_ratios(closer, swings), _REPEATS)
    theirs, peer = _best(lambda: _fit_by_differences(closer, swings), 1)
    _require_same("a fitted ratio", fit.values[:4], peer)
    return 1e3 * ours, 1e3 * theirs


def identify_more(*, swings: int = 1, samples: int = 1) -> tuple[float, float]:
    """Measures the fit of more swings, or of more samples in each swing.

    Args:
        swings: Number of swings over five.
        samples: Number of samples of a swing over 1,500; the duration of a swing stays the same.

    Returns:
        Wall time of this fit, and of the fit of five swings of 1,500 samples [ms].
    """
    closer = load_door("paper").linkage
    few = _swings(_PEAKS_DEG)
    peaks = np.linspace(_PEAKS_DEG[0], _PEAKS_DEG[-1], swings * len(_PEAKS_DEG))
    many = _swings(peaks.tolist(), rate=samples)
    grown, _ = _best(lambda: fit_ratios(closer, many), _REPEATS)
    usual, _ = _best(lambda: fit_ratios(closer, few), _REPEATS)
    return 1e3 * grown, 1e3 * usual


def simulate_1000_doors() -> tuple[float, float]:
    """Measures the simulation of 1,000 free doors from the hit to their peaks.

    Returns:
        Wall time of our simulation, and of one `solve_ivp` for each door [ms].

    Raises:
        BenchError: The two find different peaks.
    """
    link = load_door("paper").linkage.numbers()
    random = np.random.default_rng(0)
    table = np.array([random.uniform(*span, _DOORS) for span in (
        (0.0, 0.05), (0.0, 0.5), (0.0, 0.05), (0.0, 0.5), (0.05, 0.2), (0.2, 0.8))])
    speeds = random.uniform(0.3, 1.0, _DOORS)
    ours, motion = _best(lambda: follow(
        link, Ratios(*table), 0.0, speeds, until=60.0, to_peak=True), _REPEATS)

    def one_by_one() -> Array:
        return np.array([_peak(link, table[:, k], speeds[k]) for k in range(_PEERS)])

    theirs, peaks = _best(one_by_one, 1)
    _require_same("a door's peak", motion.peak_angle[:_PEERS], peaks)
    return 1e3 * ours, 1e3 * theirs * _DOORS / _PEERS


def _best(work: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Returns the shortest wall time of some runs [s], and the result of the last run."""
    times = []
    for _ in range(repeats):
        begin = perf_counter()
        answer = work()
        times.append(perf_counter() - begin)
    return min(times), answer


def _require_same(what: str, ours: Array, theirs: Array) -> None:
    worst = float(np.max(np.abs(ours / theirs - 1.0)))
    if not worst < _SAME:
        raise BenchError(
            f"{what} differs from its peer's by {worst:.2%}, at most {_SAME:.1%} is allowed")


def _swings(peaks_deg: Sequence[float], rate: int = 1) -> list[FreeSwing]:
    """Makes swings of the paper's door as its encoder measures them.

    Args:
        peaks_deg: Largest angle of each swing [deg].
        rate: Sampling rate [kHz].
    """
    door = load_door("paper").door()
    pushes, duration = five_swings(door, np.radians(peaks_deg).tolist())
    motion = simulate_pushes(door, pushes, duration, period=1e-3 / rate)
    kept = slice(rate * _SAMPLES)
    return [
        replace(swing, t=swing.t[kept], theta=swing.theta[kept])
        for swing in find_swings(from_counts(motion.t, quantise(motion)))
    ]


def _law(link: Any, ratios: Array) -> Callable[[float, Array], tuple[float, float]]:
    """Returns eq. (1) of a free door in the form that scipy integrates."""
    opening, closing, *_, spring, preload = ratios

    def slope(_t: float, x: Array) -> tuple[float, float]:
        f, eta, _ = four_bar(x[0], *link)
        damping = opening if x[1] > 0.0 else closing
        return x[1], -eta * (damping * eta * x[1] + spring * f + preload)

    return slope


def _peak(link: Any, ratios: Array, speed: float) -> float:
    """Returns the largest angle of one door after a hit [rad]."""

    def top(_t: float, x: Array) -> float:
        return float(x[1])

    top.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        _law(link, ratios), (0.0, 60.0), (0.0, speed), rtol=_RTOL, atol=_RTOL, events=top)
    return float(solution.y[0, -1])


def _fit_by_differences(closer: FourBarCloser, swings: list[FreeSwing]) -> Array:
    """Fits the ratios (4,) as a user of scipy would, with finite differences."""
    link = closer.numbers()

    def residuals(x: Array) -> Array:
        parts = []
        for swing, start in zip(swings, x[5:].reshape(-1, 2), strict=True):
            t = swing.t - swing.t[0]
            solution = solve_ivp(
                _law(link, x[:4]), (0.0, t[-1]), start, rtol=_RTOL, atol=_RTOL, t_eval=t)
            theta = solution.y[0]
            top = int(np.argmax(theta))
            shown = theta - x[4]  # the encoder's play, as in our fit
            shown[top:] = np.minimum(theta[top:], theta[top] - x[4])
            parts.append(shown - swing.theta)
        return np.concatenate(parts)

    door = load_door("paper").door().ratios()
    nominal = np.array([door.opening, door.closing, door.spring, door.preload], dtype=float)
    starts = [(swing.theta[0], swing.start_speed) for swing in swings]
    guess = np.concatenate([_GUESS_OFF * nominal, [0.0], np.ravel(starts)])
    lower = np.concatenate([np.zeros(4), np.full(1 + 2 * len(swings), -np.inf)])
    return np.asarray(least_squares(
        residuals, guess, bounds=(lower, np.inf), x_scale="jac").x[:4])
