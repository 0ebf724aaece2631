"""Whether what a robot tells is recent, and whether it still tells anything."""

from __future__ import annotations

from collections.abc import Sequence

from impact_planner.errors import InvalidRequest


class Freshness:
    """Watches topics by their stamps and by a steady tick.

    Stamps tell the age of what was heard last. Silence is counted in ticks instead: a listener that
    was itself held up finds everything old, but hears it all before the second tick.

    Args:
        topics: Their names.
        limit: Largest age and longest silence [s].
        tick: Between two calls of `tick` [s].

    Raises:
        InvalidRequest: The limit is shorter than a tick or no number.
    """

    def __init__(self, topics: Sequence[str], limit: float, tick: float) -> None:
        if not tick <= limit < float("inf"):
            raise InvalidRequest(
                f"the largest age of messages must be at least {tick:g} s, not {limit:g}",
                quantity="stale_after [s]", value=limit, limit=tick)
        self._topics = tuple(topics)
        self._limit = limit
        self._tick = tick
        self._stamps: dict[str, float] = {}
        self._ticks = dict.fromkeys(self._topics, 0)

    def heard(self, topic: str, stamp: float) -> None:
        """Takes the stamp of a message [s]."""
        self._stamps[topic] = stamp
        self._ticks[topic] = 0

    def forget(self) -> None:
        """Begins anew, as after a clock that went back."""
        self._stamps.clear()
        self._ticks = dict.fromkeys(self._topics, 0)

    @property
    def complete(self) -> bool:
        """Whether something was heard on every topic."""
        return len(self._stamps) == len(self._topics)

    def refusal(self, now: float) -> tuple[str, float] | None:
        """What is missing or too old to begin a motion.

        Args:
            now: By the clock of the stamps [s].

        Returns:
            A sentence that names topic, age and limit, and the age (infinite where nothing came);
            None where all is recent.
        """
        for topic in self._topics:
            if topic not in self._stamps:
                return f"nothing usable heard on {topic} yet", float("inf")
            age = now - self._stamps[topic]
            if age > self._limit:
                return (f"the last message on {topic} is {age:.2f} s old, at most "
                        f"{self._limit:g} s are allowed; has it stopped, or do clocks differ?", age)
            if age < -self._limit:
                return (f"the last message on {topic} is stamped {-age:.2f} s in the future, at "
                        f"most {self._limit:g} s are allowed; do clocks differ?", age)
        return None

    def tick(self) -> tuple[str, float] | None:
        """Counts a tick; the topic that has been silent for too long, and for how long [s]."""
        for topic in self._topics:
            self._ticks[topic] += 1
            silence = self._ticks[topic] * self._tick
            if silence > self._limit:
                return topic, silence
        return None
