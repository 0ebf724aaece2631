"""Changes in the status of DDS endpoints: who fits, what was missed or lost."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from cyclonedds.core import DDSException, DDSStatus
from cyclonedds.internal import DDS, dds_c_t

from ros2_embedded.wait_set import Source

Sinks = dict[int, Callable[[Any], None]]
"""The function that receives a status, by the bit of `DDSStatus`."""

_NAMES = {
    DDSStatus.OfferedDeadlineMissed: "offered_deadline_missed",
    DDSStatus.RequestedDeadlineMissed: "requested_deadline_missed",
    DDSStatus.OfferedIncompatibleQos: "offered_incompatible_qos",
    DDSStatus.RequestedIncompatibleQos: "requested_incompatible_qos",
    DDSStatus.SampleLost: "sample_lost",
    DDSStatus.LivelinessLost: "liveliness_lost",
    DDSStatus.LivelinessChanged: "liveliness_changed",
    DDSStatus.PublicationMatched: "publication_matched",
    DDSStatus.SubscriptionMatched: "subscription_matched",
}


def _read(endpoint: Any, kind: int) -> Any:
    """Reads a status, which resets its counts of changes."""
    name = _NAMES[kind]
    status = getattr(dds_c_t, f"{name}_status")()
    function = getattr(DDS._dll_handle, f"dds_get_{name}_status")
    result = function(dds_c_t.entity(endpoint._ref), ctypes.byref(status))
    if result < 0:
        raise DDSException(result, f"Occurred while reading the {name} status")
    return status


def _has_changed(status: Any) -> bool:
    return any(getattr(status, name) for name, _ in status._fields_ if name.endswith("_change"))


def changes_of(endpoint: Any, sinks: Sinks) -> Source:
    """A source that hands what has changed in the status of `endpoint` to `sinks`."""
    endpoint.set_status_mask(sum(sinks))

    def hand_over() -> None:
        for kind, sink in sinks.items():
            status = _read(endpoint, kind)
            if _has_changed(status):
                sink(status)

    return endpoint, hand_over
