"""Time law of the motion after the hit: along the same path, from the reduced speed to rest.

The run-up's spline continues past the nominal contact. While the leaf pushes back, the legs keep
their speed, and the impulse turns the whole robot back about its soles. Then the robot follows the
path with scaled time: the rate of path time falls to the ratio of the speeds after and before the
hit, which stops that turn, and from there to zero. If the legs kept the speed before the hit, the
robot would rock, because the door has taken its momentum.
"""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import Knots, from_samples
from humanoid_motion.motion import min_jerk_course
from humanoid_motion.splice import concatenate

_PERIOD = 0.005  # sampling period of the motion to rest [s]
_SAMPLES_OF_SLOWING = 11  # number of samples while the legs slow down
_FEWEST_SAMPLES = 8  # smallest number of samples of the motion to rest
_SHORTER = (1.0, 0.75, 0.5, 0.25)  # shares of the time to rest, tried in this order
_STANDING = 0.1  # share of the time to rest for a stop in place, where all of these leave the path


def way_to_rest(time: Array, duration: float) -> Array:
    """Integrate a speed that falls from 1 at time 0 to 0 at a duration as 1 - `min_jerk` [s]."""
    x = np.clip(time / duration, 0.0, 1.0)
    return np.asarray(duration * (x - 2.5 * x**4 + 3.0 * x**5 - x**6))


def path_time(
    time: Array, start: float | Array, ratio: float, rest: float, slow: float = 0.0
) -> tuple[Array, Array, Array]:
    """Compute path time and its first two derivatives while its rate falls to zero.

    First the rate falls from 1 to `ratio` as half a cosine over `slow`, then to 0 over `rest` as
    1 - `min_jerk`.

    Args:
        time: Times after the switch to this motion, (N,) [s].
        start: Path time at the switch, a number or (M, 1) [s].
        ratio: Speed after the hit divided by that before it; negative where the robot bounces back.
        rest: Time from the end of `slow` to rest [s].
        slow: Time in which the rate falls to `ratio` [s]; 0 means at once.

    Returns:
        Path time, (N,) or (M, N) [s], its rate (N,) and the rate's derivative (N,) [1/s].
    """
    inside = time < slow
    phase = np.pi * np.where(inside, time, 0.0) / max(slow, 1e-12)
    lost = 1.0 - ratio
    fallen, fall, _ = min_jerk_course(time - slow, rest)
    way_in = ratio * time + 0.5 * lost * (time + slow / np.pi * np.sin(phase))
    way_out = ratio * slow + 0.5 * lost * slow + ratio * way_to_rest(time - slow, rest)
    scaled = start + np.where(inside, way_in, way_out)
    rate = np.where(
        inside, ratio + 0.5 * lost * (1.0 + np.cos(phase)), ratio * (1.0 - fallen))
    slope = np.where(
        inside, -0.5 * np.pi / max(slow, 1e-12) * lost * np.sin(phase), -ratio * fall)
    return scaled, rate, slope


def slowing_times(rest: float, slow: float) -> Array:
    """Return sample times of the motion to rest, dense during `slow`, then every 5 ms, (N,) [s].

    Arguments are as for `path_time`.
    """
    samples = max(_FEWEST_SAMPLES, int(np.ceil(rest / _PERIOD)) + 1)
    after = slow + np.linspace(0.0, rest, samples)
    if slow == 0.0:
        return after
    return np.concatenate([np.linspace(0.0, slow, _SAMPLES_OF_SLOWING)[:-1], after])


def knots_to_rest(
    time: Array, position: Array, velocity: Array, acceleration: Array, slow: float
) -> Knots:
    """Reduce a motion at `slowing_times` to knots, with a knot at the end of the slowing down.

    A spline across that time would continue the deceleration.

    Args:
        time: Times of the samples, (N,) [s].
        position: Positions of the joints, (N, J) [rad].
        velocity: Speeds of the joints, (N, J) [rad/s].
        acceleration: Accelerations of the joints, (N, J) [rad/s^2].
        slow: Time at which the slowing down ends [s].
    """
    end = int(np.searchsorted(time, slow - 1e-9))
    return concatenate([
        from_samples(time[rows], position[rows], velocity[rows], acceleration[rows])[0]
        for rows in (slice(0, end + 1), slice(end, None)) if len(time[rows]) > 1
    ])


def continue_from(
    path: Knots, start: float, ratio: float, rest: float, slow: float = 0.0
) -> Knots:
    """Make the trajectory from a switch at a given time of the run-up to rest.

    Args:
        path: Knots of the phase `cam`, the run-up with its continuation.
        start: Path time at the switch, from the start of `cam` [s].
        ratio: Speed along the path after the hit divided by that before it.
        rest: Time from the end of `slow` to rest [s].
        slow: Time in which the speed falls to that after the hit [s].

    Returns:
        Knots whose time 0 is the switch.

    Raises:
        ValueError: The motion would leave the path at one of its ends, or rest is not positive.
    """
    if not (np.isfinite(rest) and rest > 0.0):
        raise ValueError(f"rest must be above 0, not {rest}")
    time = slowing_times(rest, slow)
    scaled, rate, slope = path_time(time, start, ratio, rest, slow)
    low, high = float(path.time[0]), float(path.time[-1])
    if not (low <= scaled.min() and scaled.max() <= high):
        raise ValueError(
            f"the path lasts from {low:.3f} to {high:.3f} s, the motion after the hit would need "
            f"it from {scaled.min():.3f} to {scaled.max():.3f} s"
        )
    position, velocity, acceleration = path.at(scaled)
    return knots_to_rest(
        time, position, velocity * rate[:, None],
        acceleration * rate[:, None] ** 2 + velocity * slope[:, None], slow)


def to_rest_within(path: Knots, start: float, ratio: float, rest: float, slow: float) -> Knots:
    """Make the trajectory to rest as `continue_from`, with a shorter time where the path ends.

    Where even the shortest time leaves the path, the robot stops almost in place.
    """
    for share in _SHORTER:
        try:
            return continue_from(path, start, ratio, share * rest, slow)
        except ValueError:
            continue
    return continue_from(path, start, 0.0, _STANDING * rest)


def back_along(path: Knots, duration: float) -> Knots:
    """Make the trajectory from the end of a path at rest back to its start, with minimum jerk.

    At each posture the accelerations are those of the path, times the square of the ratio of the
    speeds, and those of the minimum-jerk course.

    Args:
        path: Knots of the phase `cam`, the run-up with its continuation to rest.
        duration: Duration of the motion back [s].

    Returns:
        Knots from time 0.
    """
    time = np.linspace(0.0, duration, int(np.ceil(duration / _PERIOD)) + 1)
    rise, speed, acceleration = (row[:, None] for row in min_jerk_course(time, duration))
    length = path.time[-1] - path.time[0]
    position, rate, slope = path.at(path.time[-1] - length * rise[:, 0])
    return from_samples(
        time, position, -rate * length * speed,
        slope * (length * speed) ** 2 - rate * length * acceleration)[0]
