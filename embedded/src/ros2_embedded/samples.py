"""Samples as bytes: a header of four bytes and CDR."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import Any

from cyclonedds._clayer import ddspy_take, ddspy_write
from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.internal import SampleInfo

from ros2_embedded.wait_set import Source

Sample = tuple[bytes, Any]
"""The bytes, and Cyclone DDS's `SampleInfo` or its substitute."""


class _SampleInfo(partial):  # type: ignore[type-arg]
    """Keeps its arguments. It is made quickly, and without a step of Python.

    `ddspy_take` crashes if a `SampleInfo` cannot be made. If it were made in Python code, a signal
    handler could run there and raise KeyboardInterrupt.
    """


def _attribute(place: int) -> property:
    return property(lambda self: self.args[place])


for _place, _field in enumerate(fields(SampleInfo)):
    setattr(_SampleInfo, _field.name, _attribute(_place))
_VALID_DATA = [field.name for field in fields(SampleInfo)].index("valid_data")

# Called with the class that it replaces, as a partial is with a function, and with the values.
SampleInfo.__new__ = _SampleInfo  # type: ignore[method-assign, assignment]

_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
_BATCH = 64


def samples_of(reader: Any, sink: Callable[[list[Sample]], None]) -> Source:
    """A source that hands what a reader has received to `sink`."""

    def hand_over() -> None:
        taken = ddspy_take(reader._ref, _ANY, _BATCH)
        if isinstance(taken, int):
            raise DDSException(taken, f"Occurred while taking data in {reader!r}")
        samples = []
        for sample in taken:
            if sample[1].args[_VALID_DATA]:  # of a writer that went there is one without
                samples.append(sample)
        sink(samples)

    return ReadCondition(reader, _ANY), hand_over


def write(writer: Any, data: bytes) -> None:
    """Has a writer send a sample.

    Raises:
        DDSException: it cannot, as after `destroy`.
    """
    result = ddspy_write(writer._ref, data + bytes(-len(data) % 4))
    if result < 0:
        raise DDSException(result, f"Occurred while writing sample in {writer!r}")
