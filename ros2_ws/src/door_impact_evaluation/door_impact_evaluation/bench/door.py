"""How fast doors are identified and simulated, beside scipy's integrator one door at a time."""

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

from door_impact_evaluation.errors import DemoError

_PEAKS_DEG = (9.0, 13.0, 17.0, 21.0, 25.0)
_SAMPLES = 1500
_DOORS = 1000
_PEERS = 50  # doors that the peer simulates: its time is that of one door
_RTOL = 1e-8
_SAME = 1e-3
_REPEATS = 5
_GUESS_OFF = 1.2  # of the peer's first guess; ours makes its own


class DisagreementError(DemoError):
    """A benchmark and its peer do not give the same answer."""


def identify_five_swings() -> tuple[float, float]:
    """Wall time of a fit by eq. (6) of five swings of 1,500 samples [ms].

    Returns:
        Ours, and that of `solve_ivp` inside `least_squares` with finite differences.

    Raises:
        DisagreementError: The two find different doors.
    """
    closer, swings = load_door("paper").linkage, _swings(_PEAKS_DEG)
    ours, fit = _best(lambda: fit_ratios(closer, swings), _REPEATS)
    theirs, peer = _best(lambda: _fit_by_differences(closer, swings), 1)
    _require_same("a fitted ratio", fit.values[:4], peer)
    return 1e3 * ours, 1e3 * theirs


def identify_more(*, swings: int = 1, samples: int = 1) -> tuple[float, float]:
    """Wall time of a fit of more swings, or of more samples in each [ms].

    Args:
        swings: How many times five.
        samples: How many times 1,500, in the same time.

    Returns:
        That of these, and that of five swings of 1,500 samples.
    """
    closer = load_door("paper").linkage
    few = _swings(_PEAKS_DEG)
    peaks = np.linspace(_PEAKS_DEG[0], _PEAKS_DEG[-1], swings * len(_PEAKS_DEG))
    many = _swings(peaks.tolist(), rate=samples)
    grown, _ = _best(lambda: fit_ratios(closer, many), _REPEATS)
    usual, _ = _best(lambda: fit_ratios(closer, few), _REPEATS)
    return 1e3 * grown, 1e3 * usual


def simulate_1000_doors() -> tuple[float, float]:
    """Wall time of simulating 1,000 free doors from the hit to their peaks [ms].

    Returns:
        Ours, and that of one `solve_ivp` a door.

    Raises:
        DisagreementError: The two find different peaks.
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
    """Shortest wall time of some runs [s], and the answer of the last."""
    times = []
    for _ in range(repeats):
        begin = perf_counter()
        answer = work()
        times.append(perf_counter() - begin)
    return min(times), answer


def _require_same(what: str, ours: Array, theirs: Array) -> None:
    worst = float(np.max(np.abs(ours / theirs - 1.0)))
    if not worst < _SAME:
        raise DisagreementError(f"{what} is {worst:.2%} off its peer's, {_SAME:.1%} are allowed")


def _swings(peaks_deg: Sequence[float], rate: int = 1) -> list[FreeSwing]:
    """Pushes on the paper's door as its encoder shows them, 1,500 samples of each at 1 kHz."""
    door = load_door("paper").door()
    pushes, duration = five_swings(door, np.radians(peaks_deg).tolist())
    motion = simulate_pushes(door, pushes, duration, period=1e-3 / rate)
    kept = slice(rate * _SAMPLES)
    return [
        replace(swing, t=swing.t[kept], theta=swing.theta[kept])
        for swing in find_swings(from_counts(motion.t, quantise(motion)))
    ]


def _law(link: Any, ratios: Array) -> Callable[[float, Array], tuple[float, float]]:
    """Eq. (1) of a free door for scipy."""
    opening, closing, *_, spring, preload = ratios

    def slope(_t: float, x: Array) -> tuple[float, float]:
        f, eta, _ = four_bar(x[0], *link)
        damping = opening if x[1] > 0.0 else closing
        return x[1], -eta * (damping * eta * x[1] + spring * f + preload)

    return slope


def _peak(link: Any, ratios: Array, speed: float) -> float:
    """Angle at which one door turns round [rad]."""

    def top(_t: float, x: Array) -> float:
        return float(x[1])

    top.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        _law(link, ratios), (0.0, 60.0), (0.0, speed), rtol=_RTOL, atol=_RTOL, events=top)
    return float(solution.y[0, -1])


def _fit_by_differences(closer: FourBarCloser, swings: list[FreeSwing]) -> Array:
    """The same fit as a user of scipy would write it; gives the ratios (4,)."""
    link = closer.numbers()

    def residuals(x: Array) -> Array:
        parts = []
        for swing, start in zip(swings, x[5:].reshape(-1, 2), strict=True):
            t = swing.t - swing.t[0]
            solution = solve_ivp(
                _law(link, x[:4]), (0.0, t[-1]), start, rtol=_RTOL, atol=_RTOL, t_eval=t)
            theta = solution.y[0]
            top = int(np.argmax(theta))
            shown = theta - x[4]  # the encoder's play, as ours has it
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
