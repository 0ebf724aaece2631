"""Samples as they are on the wire: CDR behind its header of four bytes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cyclonedds._clayer import ddspy_take, ddspy_write
from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState

from ros2_embedded.wait_set import Source

Sample = tuple[bytes, Any]
"""The bytes, and Cyclone DDS's `SampleInfo`."""

_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
_BATCH = 64


def samples_of(reader: Any, sink: Callable[[list[Sample]], None]) -> Source:
    """A source that hands what a reader has received to `sink`."""

    def hand_over() -> None:
        taken = ddspy_take(reader._ref, _ANY, _BATCH)
        if isinstance(taken, int):
            raise DDSException(taken, f"Occurred while taking data in {reader!r}")
        # Of a writer that went there is a sample without data.
        if samples := [sample for sample in taken if sample[1].valid_data]:
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
