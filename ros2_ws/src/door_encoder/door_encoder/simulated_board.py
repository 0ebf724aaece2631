"""A counter board without hardware, as an example for users and as a stand-in for tests."""

import math
import time
from collections.abc import Callable

from door_encoder.board import CounterBoard, Reading

_REST = 3.0  # time for which the door first stays shut, so that door_encoder finds its zero [s]
_PERIOD = 4.0  # period of the swing [s]
_PEAK = 800  # largest count of the swing, 20 deg
_INDEX = 300  # count at which the index pulse comes
_START = 64000  # value of the 16-bit counter at the shut door; it wraps in each swing


class SimulatedBoard(CounterBoard):
    """A 16-bit counter on a door that rests for three seconds and then swings by 20 deg."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Set the function that returns the time [s]."""
        self._clock, self._last = clock, 0
        self._begin: float | None = None  # time of the first reading [s]

    def read(self) -> Reading:
        """Read the counter, and the index if the door has passed it since the last reading."""
        now = self._clock()
        self._begin = now if self._begin is None else self._begin
        t = max(0.0, now - self._begin - _REST)
        count = round(0.5 * _PEAK * (1.0 - math.cos(2.0 * math.pi * t / _PERIOD)))
        passed = (self._last < _INDEX) != (count < _INDEX)
        self._last = count
        return Reading((_START + count) % 2**16, (_START + _INDEX) % 2**16 if passed else None)
