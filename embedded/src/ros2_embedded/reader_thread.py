"""The one thread of a process that waits for DDS data.

A wait in Cyclone DDS cannot be interrupted by Ctrl-C. So it happens in a thread of its own, which
takes what has come and hands it to the readers' owners, who wake their executors.
"""

from __future__ import annotations

import time
import traceback
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.util import duration

from ros2_embedded.waiting_thread import WaitingThread

_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
_BATCH = 256
_FOREVER = duration(infinite=True)

Sink = Callable[[list[Any]], None]


class ReaderThread(WaitingThread):
    """Waits for all readers of a participant and hands over what they receive."""

    def __init__(self, participant: DomainParticipant) -> None:
        """Starts the thread."""
        self._due: dict[Callable[[], None], float] = {}
        super().__init__(participant, "dds_reader", OrderedDict())

    def add(self, reader: Any, sink: Sink) -> ReadCondition:
        """From now on `sink` gets lists of samples of `reader`, in this thread."""
        condition = ReadCondition(reader, _ANY)
        with self._lock:
            self._sinks[condition] = sink
            self._waitset.attach(condition)
        return condition

    def call_later(self, delay: float, function: Callable[[], None]) -> None:
        """Calls `function` in this thread after `delay` [s], unless a call of it is pending."""
        with self._lock:
            if function not in self._due:
                self._due[function] = time.monotonic() + delay
                self._guard.set(True)

    def poll(self) -> None:
        """Hands over, in the caller's thread, what has come.

        For callers that will not block: each of their short calls of C releases the interpreter's
        lock and takes it again before this thread wakes up, which can keep it waiting for seconds.
        """
        try:
            if not self._stopping and (triggered := self._waitset.wait(0)):
                with self._lock:
                    self._hand_over_all(triggered)
        except DDSException:
            if not self._stopping:  # see `WaitingThread._run`
                raise

    def _turn(self) -> None:
        timeout = _FOREVER
        with self._lock:
            if self._due:
                timeout = max(0, int((min(self._due.values()) - time.monotonic()) * 1e9))
        triggered = self._waitset.wait(timeout)
        self._guard.set(False)
        with self._lock:
            now = time.monotonic()
            for function in [f for f, at in self._due.items() if at <= now or self._stopping]:
                del self._due[function]
                function()
            self._hand_over_all(triggered)

    def _hand_over_all(self, triggered: int) -> None:
        """Looks for so many conditions with data, first where there was data last."""
        for condition in reversed(list(self._sinks)):
            if triggered <= 0:
                return
            if condition.triggered:
                triggered -= 1
                self._sinks.move_to_end(condition)
                try:
                    self._hand_over(condition, self._sinks[condition])
                except DDSException:
                    raise
                except Exception:  # a batch that cannot be read must not make the process deaf
                    traceback.print_exc()

    def _hand_over(self, condition: ReadCondition, sink: Sink) -> None:
        samples = condition.reader.take(_BATCH, condition=condition)
        valid = [sample for sample in samples if not isinstance(sample, InvalidSample)]
        if valid and not self._stopping:
            sink(valid)
