"""A pacer that holds simulated time to a multiple of real time."""

from __future__ import annotations

import time
from collections.abc import Callable

_LONGEST_LAG = 0.2  # largest delay of the simulation that is made up for afterwards [s]


class Pacer:
    """Computes how long to wait before the next step.

    Args:
        factor: Simulated time per real time; 0 means no limit.
        clock: Function that returns the real time [s].
    """

    def __init__(self, factor: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._factor = factor
        self._clock = clock
        self._due = clock()

    def advance(self, duration: float) -> None:
        """Record that simulated time has advanced by a duration [s]."""
        if self._factor > 0.0:
            self._due = max(self._due + duration / self._factor, self._clock() - _LONGEST_LAG)

    def wait(self) -> float:
        """Return the real time until the next step is due [s]; 0 if it is due now."""
        if self._factor <= 0.0:
            return 0.0
        return max(0.0, self._due - self._clock())
