"""The thread of a process that waits for changes in the status of its DDS endpoints.

Cyclone DDS could call listeners instead, but from its own threads, with its locks held: one that
waits for Python's lock while a write holds that one would never end.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from cyclonedds.core import DDSException, DDSStatus
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import DDS, dds_c_t
from cyclonedds.util import duration

from ros2_embedded.waiting_thread import WaitingThread

Sinks = dict[int, Callable[[Any], None]]
"""What gets the status, by the bit of `DDSStatus`."""

_FOREVER = duration(infinite=True)
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
    """Reads a status, by which its changes are counted anew."""
    name = _NAMES[kind]
    status = getattr(dds_c_t, f"{name}_status")()
    function = getattr(DDS._dll_handle, f"dds_get_{name}_status")
    result = function(dds_c_t.entity(endpoint._ref), ctypes.byref(status))
    if result < 0:
        raise DDSException(result, f"Occurred while reading the {name} status")
    return status


def _has_changed(status: Any) -> bool:
    return any(getattr(status, name) for name, _ in status._fields_ if name.endswith("_change"))


class StatusThread(WaitingThread):
    """Hands changes of status to whom they concern; asleep nearly always."""

    def __init__(self, participant: DomainParticipant) -> None:
        """Starts the thread."""
        super().__init__(participant, "dds_status", {})

    def watch(self, endpoint: Any, sinks: Sinks) -> None:
        """From now on `sinks` get the changes, in this thread, and now what has changed already."""
        with self._lock:
            self._sinks[endpoint] = sinks
            endpoint.set_status_mask(sum(sinks))
            self._waitset.attach(endpoint)
            self._hand_over(endpoint, sinks)

    def _turn(self) -> None:
        self._waitset.wait(_FOREVER)
        self._look_around()

    def _look_around(self) -> None:
        # Not in `_turn`: its variables would keep an endpoint alive after the last look.
        with self._lock:
            for endpoint, sinks in list(self._sinks.items()):
                if endpoint.get_status_changes():
                    self._hand_over(endpoint, sinks)

    def _hand_over(self, endpoint: Any, sinks: Sinks) -> None:
        for kind, sink in sinks.items():
            status = _read(endpoint, kind)
            if _has_changed(status) and not self._stopping:
                sink(status)
