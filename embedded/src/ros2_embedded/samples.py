"""Samples as they are on the wire: CDR behind its header of four bytes."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from cyclonedds._clayer import ddspy_take, ddspy_write
from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.internal import SampleInfo

from ros2_embedded.wait_set import Source

Sample = tuple[bytes, Any]
"""The bytes, and Cyclone DDS's `SampleInfo`, or what stands for it."""


class _SampleInfo(ctypes.Structure):
    """Made without a step of Python.

    `ddspy_take` takes a failure to make a `SampleInfo` for impossible, and crashes. But where it is
    made in Python a signal can be handled, and the handler raise an exception: KeyboardInterrupt.
    """

    _fields_ = (
        ("replaced", ctypes.py_object),
        ("sample_state", ctypes.c_uint),
        ("view_state", ctypes.c_uint),
        ("instance_state", ctypes.c_uint),
        ("valid_data", ctypes.c_bool),
        ("source_timestamp", ctypes.c_longlong),
        ("instance_handle", ctypes.c_ulonglong),
        ("publication_handle", ctypes.c_ulonglong),
        ("disposed_generation_count", ctypes.c_ulong),
        ("no_writers_generation_count", ctypes.c_ulong),
        ("sample_rank", ctypes.c_ulong),
        ("generation_rank", ctypes.c_ulong),
        ("absolute_generation_rank", ctypes.c_ulong),
    )


# Called with the class that it replaces and the values, in the order of `SampleInfo`.
SampleInfo.__new__ = _SampleInfo  # type: ignore[method-assign, assignment]

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
