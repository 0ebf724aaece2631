"""Nodes of rmw_fastrtps_cpp: topics work with them, services do not.

A reply must identify the request that it answers. rmw_cyclonedds_cpp and this runtime write the
identity before the payload (`cdds_request_header` in its serdata.hpp). rmw_fastrtps_cpp writes
nothing there: it reads GUID and number of the request from RTPS and expects them in the inline QoS
of the reply (PID_RELATED_SAMPLE_IDENTITY, DDS-RPC 1.0, 7.6.2; rmw_response.cpp of
rmw_fastrtps_shared_cpp). Cyclone DDS neither shows a reader the sequence number nor lets a writer
set the inline QoS.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from ros2_embedded import naming

_FAST_DDS = b"\x01\x0f"
_PARAMETERS = re.compile(r"(.+)/\w+_parameter(s|_types|s_atomically)")
_COMMAND = "/_ros2cli_"

Node = tuple[str, Iterable[bytes], Iterable[bytes]]
"""Full name, and the GUIDs of readers and of writers."""


def is_fast_dds(guid: bytes) -> bool:
    """Whether an entity is Fast DDS's: a GUID begins with the vendor's number (RTPS 9.3.1.5)."""
    return guid[:2] == _FAST_DDS


class Mismatch(NamedTuple):
    """A service between a node of this process and one of rmw_fastrtps_cpp."""

    own: str
    other: str
    service: str
    served: bool
    """Whether this process offers it, else it calls it."""


def _label(topic: str) -> str:
    """The name that a user knows for the service of a request topic; actions have several."""
    service = topic.removeprefix(naming.REQUEST).removesuffix("Request")
    parameters = _PARAMETERS.fullmatch(service)
    return f"{parameters[1]}'s parameters" if parameters else service.partition("/_action/")[0]


def mismatches(
    own: Iterable[Node], others: Iterable[Node], topics: Mapping[bytes, str]
) -> set[Mismatch]:
    """Services that nodes of this process share with nodes of Fast DDS.

    Args:
        own: nodes of this process.
        others: nodes of Fast DDS.
        topics: names of DDS topics by the GUIDs of their readers and writers.
    """

    def requests(guids: Iterable[bytes]) -> set[str]:
        names = {topics.get(guid, "") for guid in guids}
        return {_label(name) for name in names if name.startswith(naming.REQUEST + "/")}

    found = set()
    for other, read, written in others:
        # Each `ros2 ...` is a node of another name: they count as one.
        name = "the ros2 command" if other.startswith(_COMMAND) else other
        for mine, my_read, my_written in own:
            for served, shared in (
                (True, requests(my_read) & requests(written)),
                (False, requests(my_written) & requests(read)),
            ):
                found |= {Mismatch(mine, name, service, served) for service in shared}
    return found


def warnings(found: Iterable[Mismatch]) -> list[tuple[str, str]]:
    """The warnings to log: the full name of a node of this process, and a text on another node."""
    services: dict[tuple[str, str, bool], list[str]] = {}
    for own, other, service, served in sorted(found):
        services.setdefault((own, other, served), []).append(service)
    advice = "run it with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp"
    return [
        (
            own,
            f"{other} uses rmw_fastrtps_cpp: "
            + (f"its calls of {what} cannot be answered" if served else f"{what} cannot be called")
            + f" from here; {advice}",
        )
        for (own, other, served), names in services.items()
        for what in [", ".join(names)]
    ]
