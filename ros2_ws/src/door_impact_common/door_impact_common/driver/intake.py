"""Checks of each message about robot and door during a run, before an execution acts on it.

A single message that makes no sense is dropped and counted. Several in a row leave the topic
silent, which `Freshness` notices, because a dropped message does not count as received.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from door_impact_common.arrays import Array

AHEAD = 0.1  # largest time by which a stamp may lie ahead of the clock [s]
CURRENT = 0.05  # delay up to which a message counts as one of the present [s]


def present(clock: float, *stamps: float) -> float:
    """Return the present time [s]: that of the clock, or the newest stamp up to `CURRENT` ahead.

    The stamps of messages tell the time between two messages on a simulation's /clock.
    """
    return max([clock, *(stamp for stamp in stamps if stamp <= clock + CURRENT)])


class Arrival(NamedTuple):
    """When a message was measured, and when it arrived.

    Attributes:
        stamp: Stamp of the message [s].
        clock: Time of the clock that the stamps refer to, when the message is handled [s].
        underway: Time from the message's publication until it is handled, by the computer's clock
            [s]. Where a simulation gives the clock, that clock may be late as well.
    """

    stamp: float
    clock: float
    underway: float

    @property
    def lag(self) -> float:
        """Time by which the message lags behind the present [s]; 0 if it is one of the present."""
        late = max(self.clock - self.stamp, self.underway)
        return late if late > CURRENT else 0.0


@dataclass(frozen=True)
class Plausible:
    """What the values of a topic can be.

    Attributes:
        largest: Largest magnitude of each value; infinite where there is no limit.
        rate: Largest magnitude of the rate of change of each value [1/s].
        slack: Change of each value that is allowed at once, besides that of the rate.
        longest: Longest time without an accepted message for which the rate allows a change [s].
    """

    largest: ArrayLike
    rate: ArrayLike = np.inf
    slack: ArrayLike = 0.0
    longest: float = np.inf


class Intake:
    """Accepts or drops the messages of several topics.

    Args:
        plausible: What the values can be, by topic.

    Attributes:
        dropped: Number of messages that were dropped in the run, by topic and reason.
        late: Largest lag of an accepted message by topic [s].
        gaps: Longest time between the stamps of two accepted messages by topic [s], if it is longer
            than `CURRENT`.
    """

    def __init__(self, plausible: dict[str, Plausible]) -> None:
        self._plausible = plausible
        self._last: dict[str, tuple[float, Array]] = {}
        self.begin()

    def begin(self) -> None:
        """Begin a run: forget what was noticed in the last one."""
        self.dropped: Counter[tuple[str, str]] = Counter()
        self.late: dict[str, float] = {}
        self.gaps: dict[str, float] = {}

    def keep(self, topic: str, arrival: Arrival, values: ArrayLike) -> None:
        """Keep a message without a check, for the next one to be compared with.

        Arguments are as for `accept`.
        """
        self._last[topic] = (arrival.stamp, np.asarray(values, dtype=float))

    def accept(self, topic: str, arrival: Arrival, values: ArrayLike) -> bool:
        """Accept a message, or drop it.

        Args:
            topic: Topic of the message.
            arrival: Times of the message.
            values: The message's values, in the units of the topic's `Plausible`.

        Returns:
            Whether the message was accepted. Only an accepted one is compared with the next one.
        """
        reason = self._doubt(topic, arrival.stamp, arrival.clock, np.asarray(values, dtype=float))
        if reason:
            self.dropped[topic, reason] += 1
            return False
        if arrival.lag > 0.0:
            self.late[topic] = max(arrival.lag, self.late.get(topic, 0.0))
        gap = arrival.stamp - self._last[topic][0] if topic in self._last else 0.0
        if gap > CURRENT:
            self.gaps[topic] = max(gap, self.gaps.get(topic, 0.0))
        self.keep(topic, arrival, values)
        return True

    def noticed(self) -> dict[str, str]:
        """What was noticed in the run: a description and its number or time, as texts."""
        counted = {f"dropped on {topic}: {reason}": str(number)
                   for (topic, reason), number in sorted(self.dropped.items())}
        for what, times in (("largest lag on", self.late), ("longest gap on", self.gaps)):
            counted.update({f"{what} {topic} [s]": f"{seconds:.3f}"
                            for topic, seconds in sorted(times.items())})
        return counted

    def _doubt(self, topic: str, stamp: float, clock: float, values: Array) -> str:
        """Reason why a message makes no sense; empty if it does."""
        limits = self._plausible[topic]
        if not np.isfinite(values).all():
            return "a value is no finite number"
        if (np.abs(values) > limits.largest).any():
            return "a value is out of its range"
        if not stamp <= clock + AHEAD:
            return "the stamp lies ahead of the clock"
        if topic in self._last:
            before, last = self._last[topic]
            if stamp <= before:
                return "the stamp is not newer than the last one"
            elapsed = min(stamp - before, limits.longest)
            allowed = np.asarray(limits.slack) + np.asarray(limits.rate) * elapsed
            if (np.abs(values - last) > allowed).any():
                return "a value jumps"
        return ""
