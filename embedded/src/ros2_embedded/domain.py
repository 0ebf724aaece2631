"""Configuration of the DDS domain, and what ROS 2 writes into USER_DATA."""

from __future__ import annotations

import array
import fcntl
import os
import socket
import struct
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from html import escape

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant

MAX_PARTICIPANTS = 120
"""Participants on one machine: as many as have their own ports in a domain."""

_CALL_INTERVAL = 1
"""Period of a participant's discovery messages [s]; they need less than 0.1 % of a core."""

_SIOCGIFCONF, _IFREQ_SIZE = 0x8912, 40


def domain_id() -> int:
    """The domain that ROS_DOMAIN_ID names, 0 without it.

    Raises:
        RuntimeError: ROS_DOMAIN_ID is no number from 0 to 232.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if not text.isdecimal() or len(text.lstrip("0")) > 3 or int(text) > 232:
        shown = text if len(text) <= 20 else f"{text[:10]}... ({len(text)} characters)"
        raise RuntimeError(f"ROS_DOMAIN_ID is '{shown}': a number from 0 to 232 expected")
    return int(text)


def _only_loopback() -> bool:
    """Whether `lo` is the only interface that has an IPv4 address (Linux)."""
    buffer = array.array("B", bytes(_IFREQ_SIZE * 64))
    request = struct.pack("iL", len(buffer), buffer.buffer_info()[0])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        size = struct.unpack("iL", fcntl.ioctl(sock.fileno(), _SIOCGIFCONF, request))[0]
    names = {
        bytes(buffer[i : i + 16]).split(b"\0")[0].decode() for i in range(0, size, _IFREQ_SIZE)
    }
    return names <= {"lo"}


class DiscoveryRange(Enum):
    """How far a participant looks for others by itself: ROS_AUTOMATIC_DISCOVERY_RANGE."""

    OFF = "OFF"
    LOCALHOST = "LOCALHOST"
    SUBNET = "SUBNET"
    SYSTEM_DEFAULT = "SYSTEM_DEFAULT"


@dataclass(frozen=True)
class Discovery:
    """The discovery settings of the environment; `warnings` are for the user."""

    range: DiscoveryRange = DiscoveryRange.LOCALHOST
    peers: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def discovery(environment: Mapping[str, str]) -> Discovery:
    """Reads ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_STATIC_PEERS and ROS_LOCALHOST_ONLY as Jazzy does.

    Only the default range differs: it is this machine, in ROS 2 the subnet.
    """
    name = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "") or "LOCALHOST"
    peers = tuple(filter(None, environment.get("ROS_STATIC_PEERS", "").split(";")))
    if environment.get("ROS_LOCALHOST_ONLY", "") == "1":
        text = "ROS_LOCALHOST_ONLY is deprecated but still honored: nodes of this machine only"
        return Discovery(warnings=(text,))
    if name not in DiscoveryRange.__members__:
        text = (
            f"Invalid value '{name}' specified for 'ROS_AUTOMATIC_DISCOVERY_RANGE', "
            "assuming localhost only"
        )
        return Discovery(peers=peers, warnings=(text,))
    chosen = DiscoveryRange[name]
    if peers and chosen in (DiscoveryRange.OFF, DiscoveryRange.SYSTEM_DEFAULT):
        text = f"ROS_STATIC_PEERS is ignored: ROS_AUTOMATIC_DISCOVERY_RANGE is {name}"
        return Discovery(chosen, warnings=(text,))
    return Discovery(chosen, peers)


def domain_configuration(asked: Discovery) -> str:
    """The XML configuration of Cyclone DDS for the settings, without CYCLONEDDS_URI.

    Without multicast, participants are searched at `localhost`, on the ports of the indices from
    0 to `MAX_PARTICIPANTS`. Therefore the interface is `lo` and the index is `auto`. ROS 2 uses
    multicast by default, which is not received here. Each participant therefore keeps sending to
    all these ports, so that it also finds processes of ROS 2 that start later.
    """
    if asked.range == DiscoveryRange.SYSTEM_DEFAULT:
        return ""
    if asked.range == DiscoveryRange.OFF:
        # A unique tag: participants with other tags are ignored.
        return (
            "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General>"
            "<Discovery><ParticipantIndex>none</ParticipantIndex>"
            f"<Tag>ros_discovery_off_{os.getpid()}</Tag></Discovery></Domain></CycloneDDS>"
        )
    # Peers are searched from the first interface; `lo` reaches no other machine.
    last = ' priority="-1"' if asked.peers else ""
    interfaces = f'<NetworkInterface name="lo"{last}/>'
    if not _only_loopback():
        interfaces = '<NetworkInterface autodetermine="true"/>' + interfaces
    subnet = asked.range == DiscoveryRange.SUBNET
    multicast = "" if subnet else "<AllowMulticast>false</AllowMulticast>"
    peers = "".join(f'<Peer address="{escape(peer)}"/>' for peer in ("localhost", *asked.peers))
    return (
        f"<CycloneDDS><Domain><General><Interfaces>{interfaces}</Interfaces>{multicast}</General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MAX_PARTICIPANTS}</MaxAutoParticipantIndex>"
        f"<SPDPInterval>{_CALL_INTERVAL} s</SPDPInterval>"
        "<InitialLocatorPruneDelay>inf</InitialLocatorPruneDelay>"
        f"<Peers>{peers}</Peers></Discovery></Domain></CycloneDDS>"
    )


_domains: weakref.WeakValueDictionary[int, Domain] = weakref.WeakValueDictionary()
"""The domains that the process has joined; contexts of the same domain share it."""


def join_domain(number: int, asked: Discovery) -> tuple[Domain, DomainParticipant]:
    """Creates the domain and a participant of a process without an enclave.

    The settings in CYCLONEDDS_URI override all others.
    """
    parts = (domain_configuration(asked), os.environ.get("CYCLONEDDS_URI", ""))
    domain = _domains.get(number)
    if domain is None:
        domain = _domains[number] = Domain(number, ",".join(filter(None, parts)))
    qos = Qos(Policy.Userdata(b"enclave=/;"))
    return domain, DomainParticipant(number, qos=qos)


def parse_user_data(qos: Qos) -> dict[str, str]:
    """Reads `key=value;key=value;` from an endpoint's USER_DATA."""
    data = qos[Policy.Userdata].data if Policy.Userdata in qos else b""
    pairs = (pair.split("=", 1) for pair in data.decode("ascii", "replace").split(";"))
    return {pair[0]: pair[1] for pair in pairs if len(pair) == 2}
