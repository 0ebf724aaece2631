"""What hits have taught of each door, and when it gives way to newer hits."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import NamedTuple

from impact_planner.errors import ImplausibleHit
from impact_planner.hit.learning import ObservedHit, learn
from impact_planner.task.experience import Experience, Limits


class Lesson(NamedTuple):
    """What a hit has changed.

    Attributes:
        before: Experience before the hit.
        after: Experience after the hit.
        replaced: Whether this hit and the one before it have replaced the experience.
    """

    before: Experience
    after: Experience
    replaced: bool


class HitMemory:
    """The experience of each door.

    A hit that the experience did not expect is refused. After such a hit it is open whether the hit
    was odd or the experience is. The next hit decides: if it too contradicts the experience, but
    agrees with the refused hit, both replace the experience.

    Args:
        known: Experience by the door's name.

    Attributes:
        known: Experience by the door's name.
    """

    def __init__(self, known: Mapping[str, Experience]) -> None:
        self.known = dict(known)
        self._rivals: dict[str, Experience] = {}  # from the last hit, where it was refused

    def forget(self) -> None:
        """Forget what hits on all doors have taught."""
        self.known, self._rivals = {}, {}

    def learn(
        self, door: str, hit: ObservedHit, limits: Limits, restitution: float
    ) -> Lesson:
        """Learn from a hit.

        Args:
            door: Name of the door.
            hit: The hit.
            limits: What the learned figures can be; experience outside them is discarded.
            restitution: Configured coefficient of restitution.

        Raises:
            ImplausibleHit: The hit was not expected, and nothing was learned.
        """
        new = Experience.none(restitution)
        before = self.known.get(door, new)
        if before.outside(limits):
            before = new
        rival = self._rivals.pop(door, None)
        try:
            lesson = Lesson(before, learn(before, hit, limits), replaced=False)
        except ImplausibleHit:
            agreed = _agreed(rival, hit, limits)
            if agreed is None:
                with suppress(ImplausibleHit):
                    self._rivals[door] = learn(new, hit, limits)
                raise
            lesson = Lesson(before, agreed, replaced=True)
        self.known[door] = lesson.after
        return lesson


def _agreed(
    rival: Experience | None, hit: ObservedHit, limits: Limits
) -> Experience | None:
    """What the last hit, which was refused, and this hit teach; None if they do not agree."""
    if rival is None:
        return None
    with suppress(ImplausibleHit):
        return learn(rival, hit, limits)
    return None
