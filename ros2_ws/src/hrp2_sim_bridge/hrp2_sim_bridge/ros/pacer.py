"""Holding simulated time to a multiple of real time."""

from __future__ import annotations

import time
from collections.abc import Callable

_LONGEST_LAG = 0.2  # [s]; further behind, the lost time is not made up for


class Pacer:
    """Says how long to wait before the next step.

    Args:
        factor: simulated seconds a real second; 0 for no limit.
        clock: real time [s].
    """

    def __init__(self, factor: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._factor = factor
        self._clock = clock
        self._due = clock()

    def advance(self, duration: float) -> None:
        """Say that simulated time went on by a duration [s]."""
        if self._factor > 0.0:
            self._due = max(self._due + duration / self._factor, self._clock() - _LONGEST_LAG)

    def wait(self) -> float:
        """Real time until the next step is due [s], 0 when it is."""
        if self._factor <= 0.0:
            return 0.0
        return max(0.0, self._due - self._clock())
