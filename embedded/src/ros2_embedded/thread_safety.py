"""Functions that are safe between threads where functools and Cyclone DDS's Python are not."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any, TypeVar

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic

from ros2_embedded.interrupts import signals_wait

_F = TypeVar("_F", bound=Callable[..., Any])
_lock = threading.RLock()
_qos_lock = threading.Lock()


def once(function: _F) -> _F:
    """Caches like `functools.cache`, but all threads get the same result: classes are unique."""
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


def described(ask: Callable[..., Any], *arguments: Any) -> Any:
    """Calls `ask`, which returns endpoints or participants with their QoS.

    The lock is needed because Cyclone DDS reads the QoS of all threads' calls into the same
    variables. Signals wait because it would replace an exception of a signal handler by another.
    """
    with signals_wait(), _qos_lock:
        return ask(*arguments)


def matched_readers(writer: DataWriter[Any]) -> list[Any]:
    """The descriptions of the readers that match a writer."""
    handles = matched(writer.get_matched_subscriptions)
    found = (described(writer.get_matched_subscription_data, handle) for handle in handles)
    return [reader for reader in found if reader is not None]
