"""Checks of each message about robot and door, before anything is concluded from it.

A single message that makes no sense, or comes late, is dropped and counted. Several in a row leave
the topic silent, which `Freshness` notices, because a dropped message does not count as received.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

AHEAD = 0.1  # largest time by which a stamp may lie ahead of the clock [s]
NEW_CLOCK = 1.0  # time by which a stamp goes back where the clock was set anew [s]
FORGOTTEN = 1.0  # time without an accepted message after which the next one may be anywhere [s]
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
        names: Name and unit of each value, for messages.
    """

    largest: ArrayLike
    rate: ArrayLike = np.inf
    slack: ArrayLike = 0.0
    longest: float = np.inf
    names: Sequence[str] = ()

    def told(self, values: Array, largest: Array) -> str:
        """Say which of some values is farthest beyond its limit."""
        values = np.atleast_1d(values)
        largest = np.broadcast_to(largest, values.shape)
        with np.errstate(invalid="ignore"):
            worst = int(np.argmax(np.where(np.isfinite(values), np.abs(values) - largest, np.inf)))
        name = self.names[worst] if self.names else f"value {worst + 1}"
        return f"{name}: {values[worst]:.4g}, at most {largest[worst]:.4g}"


class Intake:
    """Accepts or drops the messages of several topics.

    Args:
        plausible: What the values can be, by topic.

    Attributes:
        dropped: Number of messages that were dropped in the run, by topic and reason.
        last_dropped: Why the last message was dropped, with the value and the limit, by topic.
        late: Largest lag of an accepted message of a motion by topic [s].
        gaps: Longest time between the stamps of two accepted messages of a motion by topic [s], if
            it is longer than `CURRENT`.
        clocks: How often the stamps began anew.
    """

    def __init__(self, plausible: Mapping[str, Plausible]) -> None:
        self._plausible = plausible
        self.clocks = 0
        self.forget()
        self.begin()

    def forget(self) -> None:
        """Forget the last messages, so that the next ones may be anywhere."""
        self._last: dict[str, tuple[float, Array]] = {}

    def begin(self) -> None:
        """Begin a run: forget what was noticed in the last one."""
        self.dropped: Counter[tuple[str, str]] = Counter()
        self.last_dropped: dict[str, str] = {}
        self.late: dict[str, float] = {}
        self.gaps: dict[str, float] = {}

    def accept(
        self, topic: str, arrival: Arrival, values: ArrayLike, *, in_motion: bool = False
    ) -> bool:
        """Accept a message, or drop it.

        Args:
            topic: Topic of the message.
            arrival: Times of the message.
            values: The message's values, in the units of the topic's `Plausible`.
            in_motion: Whether a motion is under way. Then no stamp begins a new clock, and lags and
                gaps are noted.

        Returns:
            Whether the message was accepted. Only an accepted one is compared with the next one.
        """
        stamp, found = arrival.stamp, np.asarray(values, dtype=float)
        before = self._last[topic][0] if topic in self._last else stamp
        reason, told = self._senseless(topic, arrival, found)
        if not reason:
            if before - stamp > NEW_CLOCK and not in_motion:
                self.clocks += 1
                self.forget()
            reason, told = self._out_of_line(topic, stamp, found)
        if reason:
            self.dropped[topic, reason] += 1
            self.last_dropped[topic] = f"{reason} ({told})"
            return False
        if in_motion and arrival.lag > 0.0:
            self.late[topic] = max(arrival.lag, self.late.get(topic, 0.0))
        if in_motion and stamp - before > CURRENT:
            self.gaps[topic] = max(stamp - before, self.gaps.get(topic, 0.0))
        self._last[topic] = (stamp, found)
        return True

    def noticed(self) -> dict[str, str]:
        """What was noticed in the run: a description and its number or time, as texts."""
        counted = {f"dropped on {topic}: {reason}": str(number)
                   for (topic, reason), number in sorted(self.dropped.items())}
        for what, times in (("largest lag on", self.late), ("longest gap on", self.gaps)):
            counted.update({f"{what} {topic} [s]": f"{seconds:.3f}"
                            for topic, seconds in sorted(times.items())})
        return counted

    def _senseless(self, topic: str, arrival: Arrival, values: Array) -> tuple[str, str]:
        """Reason why a message makes no sense by itself, and its value; empty if it does."""
        limits = self._plausible[topic]
        if not np.isfinite(values).all():
            return "a value is no finite number", limits.told(values, np.asarray(limits.largest))
        if (np.abs(values) > limits.largest).any():
            return "a value is out of its range", limits.told(values, np.asarray(limits.largest))
        if not arrival.stamp <= arrival.clock + AHEAD:
            return ("the stamp lies ahead of the clock",
                    f"{arrival.stamp:.3f} s, the clock is at {arrival.clock:.3f} s")
        return "", ""

    def _out_of_line(self, topic: str, stamp: float, values: Array) -> tuple[str, str]:
        """Reason why a message does not follow the last one, and its value; empty if it does."""
        if topic not in self._last:
            return "", ""
        limits, (before, last) = self._plausible[topic], self._last[topic]
        if stamp <= before:
            return "the stamp is not newer than the last one", f"{stamp:.3f} s, {before:.3f} s"
        elapsed = min(stamp - before, limits.longest)
        allowed = np.asarray(limits.slack) + np.asarray(limits.rate) * elapsed
        change = np.abs(values - last)
        if (change > allowed).any() and stamp - before <= FORGOTTEN:
            return "a value jumps", limits.told(change, allowed)
        return "", ""
