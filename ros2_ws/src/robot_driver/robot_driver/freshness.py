"""Checks that messages are recent, and that they still arrive."""

from __future__ import annotations

from collections.abc import Sequence

from door_impact_common.errors import SettingError


class Freshness:
    """Watches topics by the stamps of their messages and by a steady tick.

    The stamp gives the age of the last message, which must be small for a motion to begin. During
    the motion the time without a message is counted in ticks: after a pause of the whole process
    all stamps are old, but the messages that have waited are received before the second tick.

    Args:
        topics: Names of the topics.
        limit: Largest allowed age of a message, and longest allowed time without one [s].
        tick: Time between two calls of `tick` [s].
        optional: Those of the topics that a driver may lack; they are watched from their first
            message on.

    Attributes:
        limit: Largest allowed age of a message, and longest allowed time without one [s].
        needed: Those of the topics whose silence `tick` finds; at first all.

    Raises:
        SettingError: The limit is shorter than a tick or not finite.
    """

    def __init__(
        self, topics: Sequence[str], limit: float, tick: float, optional: Sequence[str] = ()
    ) -> None:
        if not tick <= limit < float("inf"):
            raise SettingError(
                "stale_after, the largest age of messages [s],", limit, f"at least {tick:g} s")
        self.limit = limit
        self._topics, self._optional = tuple(topics), tuple(optional)
        self.needed: Sequence[str] = self._topics
        self._tick = tick
        self._stamps: dict[str, float] = {}
        self._ticks = dict.fromkeys(self._topics, 0)

    def received(self, topic: str, stamp: float) -> None:
        """Note that a message with this stamp [s] has arrived; other topics are not watched."""
        if topic in self._ticks:
            self._stamps[topic] = stamp
            self._ticks[topic] = 0

    def forget(self) -> None:
        """Forget all messages, as after a clock that went back."""
        self._stamps.clear()
        self._ticks = dict.fromkeys(self._topics, 0)

    def complete(self, topics: Sequence[str]) -> bool:
        """Return whether a message has arrived on each of some topics that is not optional."""
        return all(topic in self._stamps for topic in topics if topic not in self._optional)

    def handled(self) -> float:
        """Return the stamp up to which messages of all needed topics have arrived [s].

        -inf before the first of a topic that is not optional.
        """
        return min((self._stamps.get(topic, float("-inf"))
                    for topic in self._watched(self.needed)), default=float("-inf"))

    def _watched(self, topics: Sequence[str]) -> list[str]:
        return [topic for topic in topics
                if topic in self._stamps or topic not in self._optional]

    def refusal(self, now: float, topics: Sequence[str]) -> tuple[str, str, float] | None:
        """Find a topic whose last message is missing or too old for a motion to begin.

        Args:
            now: Time of the clock that the stamps refer to [s].
            topics: Topics that the motion needs.

        Returns:
            The topic, a sentence that names it, the age and the limit, and the age [s], which is
            infinite if no message has arrived; None if all messages are recent.
        """
        for topic in self._watched(topics):
            if topic not in self._stamps:
                return topic, f"no usable message has arrived on {topic} yet", float("inf")
            age = now - self._stamps[topic]
            if age > self.limit:
                return (topic, f"the last message on {topic} is {age:.2f} s old, at most "
                        f"{self.limit:g} s are allowed; has its publisher stopped, or do the "
                        "clocks differ?", age)
            if age < -self.limit:
                return (topic, f"the stamp of the last message on {topic} lies {-age:.2f} s in the "
                        f"future, at most {self.limit:g} s are allowed; do the clocks differ?", age)
        return None

    def tick(self) -> tuple[str, float] | None:
        """Count a tick, and find a topic without a message for too long.

        Returns:
            The topic and the time since its last message [s]; None if messages arrive on all.
        """
        for topic in self._watched(self.needed):
            self._ticks[topic] += 1
            waited = self._ticks[topic] * self._tick
            if waited > self.limit:
                return topic, waited
        return None
