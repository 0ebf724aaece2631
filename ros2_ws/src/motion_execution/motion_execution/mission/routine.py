"""Coroutines that wait for conditions, without an event loop.

A mission waits for things that a robot's messages show: that a motion has ended, that a plan is
there. It goes on when its caller polls it, after each message of a graph or after each tick of a
simulation. So one clock alone decides what happens when, and a simulated run repeats exactly.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Coroutine, Generator
from typing import Any, Generic, TypeVar

Found = TypeVar("Found")
Condition = Callable[[], bool]


@types.coroutine
def until(condition: Condition) -> Generator[Condition, None, None]:
    """Wait until a condition holds; it may be evaluated any number of times."""
    while not condition():
        yield condition


class Routine(Generic[Found]):
    """A coroutine that goes on whenever what it waits for has come.

    Attributes:
        done: Whether it has ended.
    """

    def __init__(self, coroutine: Coroutine[Condition, None, Found]) -> None:
        self._coroutine = coroutine
        self._waits: Condition = lambda: True
        self._result: Found | None = None
        self._error: Exception | None = None
        self.done = False

    def poll(self) -> None:
        """Go on as far as possible."""
        while not self.done and self._waits():
            try:
                self._waits = self._coroutine.send(None)
            except StopIteration as end:
                self.done, self._result = True, end.value
            except Exception as error:  # it belongs to whoever asks for the result
                self.done, self._error = True, error

    def result(self) -> Any:
        """Return what the coroutine has returned, or raise what it has raised."""
        if self._error is not None:
            raise self._error
        return self._result
