"""What must hold between threads, and neither functools nor Cyclone DDS's Python makes hold."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any, TypeVar

from cyclonedds.domain import DomainParticipant
from cyclonedds.topic import Topic

_F = TypeVar("_F", bound=Callable[..., Any])
_lock = threading.RLock()


def once(function: _F) -> _F:
    """Like `functools.cache`, but two threads never get different results: classes are unique."""
    cached = functools.cache(function)

    @functools.wraps(function)
    def guarded(*arguments: Any) -> Any:
        with _lock:
            return cached(*arguments)

    return guarded  # type: ignore[return-value]


def make_topic(participant: DomainParticipant, name: str, kind: Any) -> Topic[Any]:
    """A DDS topic: the first one of a type fills in the type's description."""
    with _lock:
        return Topic(participant, name, kind)


def matched(ask: Callable[[], list[int]]) -> list[int]:
    """Handles of the endpoints that match one.

    Cyclone DDS asks for their number first, and fails if it has grown when it reads them.
    """
    while True:
        try:
            return ask()
        except IndexError:
            continue
