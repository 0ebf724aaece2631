"""First guesses and bounds of the unknowns of a fit."""

from collections.abc import Mapping, Sequence

import numpy as np
from door_impact_common.arrays import Array

from door_model.recording.swings import CLOSING_END, FreeSwing

_HIGHEST_LATCH = np.radians(25.0)  # largest angle of a latch zone [rad]; 7 to 15 deg are usual
_LATCH_STARTS = np.radians([4.0, 7.0, 10.0, 13.0, 16.0])  # guesses of a latch zone's angle [rad]
_BACKCHECK_STARTS = np.linspace(0.4, 0.9, 6)  # guesses of a backcheck's angle / highest peak
_FRICTION_START = 0.03  # guess of the friction / preload
_MOST_PLAY = np.radians(2.0)  # largest play of the encoder [rad]; more is a loose coupling
_START_AWAY = 0.1  # largest distance of a swing's start from its first sample [rad]
_START_FASTER = 3.0  # largest speed at the start / speed that the samples around it show


def first_guesses(free: tuple[str, ...], known: Mapping[str, float], highest: float) -> list[Array]:
    """Return first guesses of the shared unknowns, one for each angle at which a zone may begin.

    Args:
        free: Names of the unknowns (P,), as in `trajectory_fit.fit_ratios`.
        known: Guesses of some unknowns by name, the ratios of opening and preload among them.
        highest: Largest angle of the swings [rad].
    """
    guess = {"closing": known["opening"], "play": 0.0, "zero": 0.0,
             "friction": _FRICTION_START * abs(known["preload"]), **known}
    for zone, other in (("latch", "closing"), ("backcheck", "opening")):
        guess.setdefault(zone, guess[other])
    guesses = [guess]
    for name, places in (
        ("latch_angle", _LATCH_STARTS), ("backcheck_angle", _BACKCHECK_STARTS * highest)):
        if name in free and name not in known:
            guesses = [{**one, name: place} for one in guesses for place in places]
    return [np.array([one[name] for name in free]) for one in guesses]


def fit_bounds(
    free: tuple[str, ...], swings: Sequence[FreeSwing], given: Mapping[str, tuple[float, float]]
) -> tuple[Array, Array]:
    """Return lower and upper bounds of all unknowns: the shared ones, then the starts.

    Args:
        free: Names of the unknowns that the swings share (P,).
        swings: The swings (S,).
        given: Bounds of some shared unknowns by name, in place of the default bounds.

    Returns:
        Two arrays (P + 2 S,), in the units of `Ratios`, rad and rad/s.
    """
    highest = max(float(swing.theta.max()) for swing in swings)
    own = {
        # Play may be negative: a fit to noise scatters to both sides of 0.
        "play": (-_MOST_PLAY, _MOST_PLAY),
        "zero": (-np.inf, np.inf),
        "preload": (-np.inf, np.inf),  # negative if f is large at the closed door
        "latch_angle": (CLOSING_END, min(_HIGHEST_LATCH, highest)),
        "backcheck_angle": (CLOSING_END, highest),
        **given,
    }
    every = [own.get(name, (0.0, np.inf)) for name in free]
    for swing in swings:
        every += [(swing.theta[0] - _START_AWAY, swing.theta[0] + _START_AWAY),
                  (0.0, _START_FASTER * swing.start_speed)]
    spans = np.array(every)
    return spans[:, 0], spans[:, 1]
