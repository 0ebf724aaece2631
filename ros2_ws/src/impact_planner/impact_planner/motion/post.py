"""What follows the hit: the same path, from the reduced speed to rest.

The run-up's spline goes on past the nominal contact. The legs keep its speed while the leaf pushes
back: the robot, in one piece, is turned back about its soles by the impulse. Then it follows the
path with time scaled: the rate of path time falls to what the hit has left of the speed, which
stops that turn, and from there to zero. Going on at the speed before the hit would make the robot
rock against a door that has taken its momentum.
"""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import TOLERANCE, Knots, from_samples
from humanoid_motion.splice import concatenate

_PERIOD = 0.005  # [s]
_SAMPLES_OF_SLOWING = 11
_SHORTER = (1.0, 0.75, 0.5, 0.25)  # shares of the time to rest, tried in this order
_STANDING = 0.1  # the share where none of them stays on the path


def path_time(
    time: Array, start: float | Array, ratio: float, rest: float, slow: float = 0.0
) -> tuple[Array, Array, Array]:
    """Path time and its first two derivatives while the rate falls to zero.

    First the rate falls from 1 to `ratio` as half a cosine; then it follows
    ratio (1 - (10 x^3 - 15 x^4 + 6 x^5)).

    Args:
        time: From the switch to this motion, (N,) [s].
        start: Path time at the switch, a number or (M, 1) [s].
        ratio: Rate after the hit; negative where the robot bounces back.
        rest: From when that is reached until rest [s].
        slow: In which it is reached [s]; 0: at once.

    Returns:
        Path time, (N,) or (M, N), its rate and the rate of that, (N,) each.
    """
    inside = time < slow
    phase = np.pi * np.where(inside, time, 0.0) / max(slow, 1e-12)
    lost = 1.0 - ratio
    x = np.clip((time - slow) / rest, 0.0, 1.0)
    way_in = ratio * time + 0.5 * lost * (time + slow / np.pi * np.sin(phase))
    way_out = (ratio * slow + 0.5 * lost * slow
               + ratio * rest * (x - 2.5 * x**4 + 3.0 * x**5 - x**6))
    scaled = start + np.where(inside, way_in, way_out)
    rate = np.where(inside, ratio + 0.5 * lost * (1.0 + np.cos(phase)),
                    ratio * (1.0 - x**3 * (10.0 - 15.0 * x + 6.0 * x**2)))
    slope = np.where(inside, -0.5 * np.pi / max(slow, 1e-12) * lost * np.sin(phase),
                     -ratio / rest * 30.0 * x**2 * (1.0 - x) ** 2)
    return scaled, rate, slope


def sample_times(rest: float, slow: float) -> Array:
    """Times at which to sample the motion: densely while it is slowed down, then every 5 ms [s]."""
    after = slow + np.linspace(0.0, rest, max(8, int(np.ceil(rest / _PERIOD)) + 1))
    if slow == 0.0:
        return after
    return np.concatenate([np.linspace(0.0, slow, _SAMPLES_OF_SLOWING)[:-1], after])


def knots_to_rest(
    time: Array, position: Array, velocity: Array, acceleration: Array, slow: float,
    tolerance: float = TOLERANCE,
) -> Knots:
    """Knots of a motion at `sample_times`, one of them where the slowing down ends.

    A spline across that would go on braking.

    Args:
        time: (N,) [s].
        position: (N, J) [rad].
        velocity: (N, J) [rad/s].
        acceleration: (N, J) [rad/s^2].
        slow: See `path_time` [s].
        tolerance: Of the knots [rad].
    """
    end = int(np.searchsorted(time, slow - 1e-9))
    return concatenate([
        from_samples(time[rows], position[rows], velocity[rows], acceleration[rows], tolerance)[0]
        for rows in (slice(0, end + 1), slice(end, None)) if len(time[rows]) > 1
    ])


def continue_from(
    path: Knots, start: float, ratio: float, rest: float, slow: float = 0.0,
    tolerance: float = TOLERANCE,
) -> Knots:
    """Trajectory from a switch at a given time of the run-up to rest.

    Args:
        path: The run-up with what follows it (phase `cam`).
        start: Path time at the switch [s], by the clock of the run-up.
        ratio: Speed along the path after the hit over that before it.
        rest: See `path_time` [s].
        slow: The same [s].
        tolerance: Of the knots [rad].

    Returns:
        Knots from time 0 (the switch) on.

    Raises:
        ValueError: The path would be left at either end; or rest is not positive.
    """
    if not (np.isfinite(rest) and rest > 0.0):
        raise ValueError(f"rest must be above 0, not {rest}")
    time = sample_times(rest, slow)
    scaled, rate, slope = path_time(time, start, ratio, rest, slow)
    low, high = float(path.time[0]), float(path.time[-1])
    if not (low <= scaled.min() and scaled.max() <= high):
        raise ValueError(
            f"the path goes from {low:.3f} to {high:.3f} s, the motion after the hit would go "
            f"from {scaled.min():.3f} to {scaled.max():.3f} s"
        )
    position, velocity, acceleration = path.at(scaled)
    return knots_to_rest(
        time, position, velocity * rate[:, None],
        acceleration * rate[:, None] ** 2 + velocity * slope[:, None], slow, tolerance)


def to_rest_within(
    path: Knots, start: float, ratio: float, rest: float, slow: float
) -> Knots:
    """`continue_from`, to rest sooner where the path ends before."""
    for share in _SHORTER:
        try:
            return continue_from(path, start, ratio, share * rest, slow)
        except ValueError:
            continue
    return continue_from(path, start, 0.0, _STANDING * rest)  # where it is, at once
