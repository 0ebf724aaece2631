"""The capture point: where the robot would have to put its weight in order to come to rest."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY

WINDOW = 0.1  # time over which the CoM's velocity is taken; its delay is half of that [s]
_ENOUGH = 3  # samples for a velocity


def capture_point(time: Array, com: Array) -> Array:
    """Return the capture point of a linear inverted pendulum, (2,) [m].

    It is x + v / omega0 with omega0 = sqrt(g / z): place x, velocity v and height z of the CoM
    (J. Pratt, J. Carff, S. Drakunov, A. Goswami, *Capture point: a step toward humanoid push
    recovery*, Humanoids 2006, eq. (9)). The velocity is the slope of the least-squares line
    through all samples.

    Args:
        time: Times of the samples, (N,) with N >= 2 [s].
        com: The CoM at these times, in a frame with z up and 0 on the floor, (N, 3) [m].
    """
    moved = time - time.mean()
    velocity = moved @ com[:, :2] / (moved @ moved)
    height = max(float(com[-1, 2]), 0.0)
    return np.asarray(com[-1, :2] + velocity * math.sqrt(height / GRAVITY))


class CaptureEstimator:
    """The capture point from one CoM after another."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, Array]] = deque()

    def update(self, time: float, com: Array) -> Array | None:
        """Take a sample, and return the capture point.

        Args:
            time: Stamp [s]; a stamp of before the last one begins anew.
            com: The CoM, (3,) [m].

        Returns:
            x and y, (2,) [m]; None as long as the samples cover too little time.
        """
        samples = self._samples
        if samples and time < samples[-1][0]:
            samples.clear()
        if not samples or time > samples[-1][0]:
            samples.append((time, com))
        while time - samples[0][0] > WINDOW:
            samples.popleft()
        if len(samples) < _ENOUGH:
            return None
        return capture_point(np.array([row[0] for row in samples]),
                             np.array([row[1] for row in samples]))
