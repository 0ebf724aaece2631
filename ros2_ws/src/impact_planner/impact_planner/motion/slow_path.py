"""A path that is followed slowly, at an even speed of point B."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import Knots, from_motion
from humanoid_motion.motion import rest_to_rest

from impact_planner.errors import InvalidRequest
from impact_planner.motion.post import way_to_rest

RAMP = 0.5
"""Time in which B reaches the even speed, and in which it comes to rest [s]."""
_SAMPLES = 400  # number of postures along the path
_NODES = 0.05  # time between solved postures, which a spline connects [s]
_PERIOD = 0.01  # sampling period [s]


def ways_along(path: Knots, reach: Callable[[Array], float]) -> tuple[Array, Array]:
    """Compute how far B has come at times of a path.

    Args:
        reach: Function that returns the way of B towards the door [m] at joint positions (J,)
            [rad].

    Returns:
        Times (N,) [s], and ways, none of which is shorter than the one before, (N,) [m].
    """
    time = np.linspace(float(path.time[0]), float(path.time[-1]), _SAMPLES)
    ways = np.array([reach(row) for row in path.at(time)[0]])
    return time, np.maximum.accumulate(ways)


def slow_path(path: Knots, time: Array, ways: Array, speed: float) -> Knots:
    """Follow a path from rest to rest, with B at an even speed.

    The path's own time cannot be stretched evenly: near its ends B hardly moves.

    Args:
        time: Times along the path, (N,) [s].
        ways: Ways of B at them, as of `ways_along`, (N,) [m].
        speed: Even speed of B [m/s].

    Raises:
        InvalidRequest: The path is too short for the speed to be reached.
    """
    length = float(ways[-1] - ways[0])
    if length < 2.0 * speed * RAMP:
        raise InvalidRequest(
            f"the path moves B by {length:.3f} m towards the door, a slow motion along it needs "
            f"{2.0 * speed * RAMP:.3f} m", quantity="way [m]", value=length,
            limit=2.0 * speed * RAMP)
    end = length / speed + RAMP
    nodes = np.linspace(0.0, end, math.ceil(end / _NODES) + 1)
    since = np.minimum(nodes, end - nodes)  # the way from rest is that to rest, backwards
    way = speed * (since - way_to_rest(since, RAMP))
    way = ways[0] + np.where(nodes < 0.5 * end, way, length - way)
    joints = path.at(np.interp(way, ways, time))[0]
    samples = np.linspace(0.0, end, math.ceil(end / _PERIOD) + 1)
    return from_motion(rest_to_rest(nodes, joints, np.zeros((len(nodes), 3)), samples))
