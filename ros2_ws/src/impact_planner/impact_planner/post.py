"""What follows the hit: the same path, from the reduced speed to rest.

The run-up's spline goes on past the nominal contact. After the hit the robot follows it with
time scaled: during the contact the rate of path time falls as the speed of the robot does, so that
the legs neither push nor brake and the floor takes no part in eq. (2); then it falls to zero. Going
on at the speed before the hit would make the feet slip and the robot rock against a door that has
taken its momentum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .knots import TOLERANCE, Knots, from_samples

Array = NDArray[np.float64]

_PERIOD = 0.005  # [s]
_SAMPLES_OF_CONTACT = 31


def path_time(
    time: Array, start: float | Array, ratio: float, rest: float, contact: float = 0.0
) -> tuple[Array, Array, Array]:
    """Path time and its first two derivatives while the rate falls to zero.

    During the contact the rate falls from 1 to `ratio` as half a cosine, the speed of a mass that
    is slowed down by half a sine of force; then it follows ratio (1 - (10 x^3 - 15 x^4 + 6 x^5)).

    Args:
        time: From the switch to this motion, (N,) [s].
        start: Path time at the switch, a number or (M, 1) [s].
        ratio: Rate after the contact; negative where the robot bounces back.
        rest: From the end of the contact until rest [s].
        contact: Duration of the contact [s]; 0: the rate drops at once.

    Returns:
        Path time, (N,) or (M, N), its rate and the rate of that, (N,) each.
    """
    inside = time < contact
    phase = np.pi * np.where(inside, time, 0.0) / max(contact, 1e-12)
    lost = 1.0 - ratio
    x = np.clip((time - contact) / rest, 0.0, 1.0)
    way_in = ratio * time + 0.5 * lost * (time + contact / np.pi * np.sin(phase))
    way_out = (ratio * contact + 0.5 * lost * contact
               + ratio * rest * (x - 2.5 * x**4 + 3.0 * x**5 - x**6))
    scaled = start + np.where(inside, way_in, way_out)
    rate = np.where(inside, ratio + 0.5 * lost * (1.0 + np.cos(phase)),
                    ratio * (1.0 - x**3 * (10.0 - 15.0 * x + 6.0 * x**2)))
    slope = np.where(inside, -0.5 * np.pi / max(contact, 1e-12) * lost * np.sin(phase),
                     -ratio / rest * 30.0 * x**2 * (1.0 - x) ** 2)
    return scaled, rate, slope


def sample_times(rest: float, contact: float) -> Array:
    """Times at which to sample the motion: densely during the contact, then every 5 ms [s]."""
    after = contact + np.linspace(0.0, rest, max(8, int(np.ceil(rest / _PERIOD)) + 1))
    if contact == 0.0:
        return after
    return np.concatenate([np.linspace(0.0, contact, _SAMPLES_OF_CONTACT)[:-1], after])


def continue_from(
    path: Knots, start: float, ratio: float, rest: float, tolerance: float = TOLERANCE
) -> Knots:
    """Trajectory from a switch at a given time of the run-up to rest.

    Args:
        path: The run-up with its extension (phase `cam`).
        start: Path time at the switch [s], by the clock of the run-up.
        ratio: Speed along the path after the hit over that before it.
        rest: From the switch to rest [s].
        tolerance: Of the knots [rad].

    Returns:
        Knots from time 0 (the switch) on.

    Raises:
        ValueError: The path would be left at either end; or rest is not positive.
    """
    if not (np.isfinite(rest) and rest > 0.0):
        raise ValueError(f"rest must be above 0, not {rest}")
    time = sample_times(rest, 0.0)
    scaled, rate, slope = path_time(time, start, ratio, rest)
    low, high = float(path.time[0]), float(path.time[-1])
    if not (low <= scaled.min() and scaled.max() <= high):
        raise ValueError(
            f"the path goes from {low:.3f} to {high:.3f} s, the motion after the hit would go "
            f"from {scaled.min():.3f} to {scaled.max():.3f} s"
        )
    position, velocity, acceleration = path.at(scaled)
    knots, _ = from_samples(
        time,
        position,
        velocity * rate[:, None],
        acceleration * rate[:, None] ** 2 + velocity * slope[:, None],
        tolerance,
    )
    return knots
