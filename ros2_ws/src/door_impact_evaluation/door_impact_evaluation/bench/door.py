"""Measure how fast doors are identified and simulated; the peer is scipy, one door at a time.

Each benchmark takes the number of its runs, of which the fastest counts, and returns its processor
time and its peer's [ms]. It raises `BenchError` if the two find different results.
"""

from collections.abc import Callable
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_model.door.closer import four_bar
from door_model.door.config import load_door
from door_model.door.ratios import Ratios
from door_model.identification.trajectory_fit import fit_ratios
from door_model.motion.free_motion import follow
from door_model.recording.swings import find_swings
from door_model.recording.synthetic import synthetic_recording
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from door_impact_evaluation.errors import BenchError

_PEAKS_DEG = (9.0, 13.0, 17.0, 21.0, 25.0)  # largest angles of the swings [deg]
_SAMPLES = 1500   # samples of each swing, at 1 kHz
_DOORS = 1000     # doors that are simulated together
_PEERS = 50       # doors that the peer simulates; its time for all doors is scaled from these
_TOLERANCES = {"rtol": 1e-8, "atol": 1e-8}  # of the peer's integrator
_SAME = 1e-3      # largest relative difference between the two results
_GUESS_OFF = 1.2  # ratio of the peer's first guess to the true values; our fit finds its own guess


def identify_five_swings(repeats: int) -> tuple[float, float]:
    """Measure the fit by eq. (6) of five swings, beside `least_squares` around `solve_ivp`."""
    config = load_door("paper")
    closer, link, door = config.linkage, config.linkage.numbers(), config.door()
    swings = [replace(swing, t=swing.t[:_SAMPLES], theta=swing.theta[:_SAMPLES]) for swing in
              find_swings(synthetic_recording(door, np.radians(_PEAKS_DEG).tolist()))]

    def residuals(x: Array) -> Array:
        parts = []
        for swing, start in zip(swings, x[5:].reshape(-1, 2), strict=True):
            t = swing.t - swing.t[0]
            theta = solve_ivp(_law(link, x[:4]), (0.0, t[-1]), start, t_eval=t, **_TOLERANCES).y[0]
            top = int(np.argmax(theta))
            shown = theta - x[4]  # the encoder's play, as in our fit
            shown[top:] = np.minimum(theta[top:], theta[top] - x[4])
            parts.append(shown - swing.theta)
        return np.concatenate(parts)

    true = door.ratios()
    nominal = np.array([true.opening, true.closing, true.spring, true.preload], dtype=float)
    starts = np.ravel([(swing.theta[0], swing.start_speed) for swing in swings])
    guess = np.concatenate([_GUESS_OFF * nominal, [0.0], starts])
    lower = np.concatenate([np.zeros(4), np.full(1 + len(starts), -np.inf)])
    theirs, peer = timed(
        lambda: least_squares(residuals, guess, bounds=(lower, np.inf), x_scale="jac").x[:4])
    ours = min(timed(lambda: fit_ratios(closer, swings))[0] for _ in range(repeats))
    _require_same("a fitted ratio", fit_ratios(closer, swings).values[:4], peer)
    return 1e3 * ours, 1e3 * theirs


def simulate_1000_doors(repeats: int) -> tuple[float, float]:
    """Measure 1,000 free doors from the hit to their peaks, beside one `solve_ivp` for each."""
    link = load_door("paper").linkage.numbers()
    random = np.random.default_rng(0)
    table = np.array([random.uniform(*span, _DOORS) for span in (
        (0.0, 0.05), (0.0, 0.5), (0.0, 0.05), (0.0, 0.5), (0.05, 0.2), (0.2, 0.8))])
    speeds = random.uniform(0.3, 1.0, _DOORS)

    def top(_t: float, x: Array) -> float:
        return float(x[1])

    top.terminal = True  # type: ignore[attr-defined]

    def together() -> Array:
        motion = follow(link, Ratios(*table), 0.0, speeds, until=60.0, to_peak=True)
        return motion.peak_angle[:_PEERS]

    def one_by_one() -> Array:
        return np.array([
            solve_ivp(_law(link, table[:, k]), (0.0, 60.0), (0.0, speeds[k]), events=top,
                      **_TOLERANCES).y[0, -1] for k in range(_PEERS)])

    ours = min(timed(together)[0] for _ in range(repeats))
    theirs, peaks = timed(one_by_one)
    _require_same("a door's peak", together(), peaks)
    return 1e3 * ours, 1e3 * theirs * _DOORS / _PEERS


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the processor time of a call [s], and its result."""
    begin = process_time()
    answer = work()
    return process_time() - begin, answer


def _require_same(what: str, ours: Array, theirs: Array) -> None:
    worst = float(np.max(np.abs(ours / theirs - 1.0)))
    if not worst < _SAME:
        raise BenchError(
            f"{what} differs from its peer's by {worst:.2%}, at most {_SAME:.1%} is allowed")


def _law(link: Any, ratios: Array) -> Callable[[float, Array], tuple[float, float]]:
    """Return eq. (1) of a free door in the form that scipy integrates."""
    opening, closing, *_, spring, preload = ratios

    def slope(_t: float, x: Array) -> tuple[float, float]:
        f, eta, _ = four_bar(x[0], *link)
        damping = opening if x[1] > 0.0 else closing
        return x[1], -eta * (damping * eta * x[1] + spring * f + preload)

    return slope
