"""Configuration of the DDS domain, and what ROS 2 writes into USER_DATA."""

from __future__ import annotations

import array
import fcntl
import os
import socket
import struct

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant

MAX_PARTICIPANTS = 120
"""Participants on one machine: as many as have their own ports in a domain."""

_CALL_INTERVAL = 1
"""How often a participant calls where others may be [s]; that takes under 0.1 % of a core."""

_SIOCGIFCONF, _IFREQ_SIZE = 0x8912, 40


def domain_id() -> int:
    """The domain that ROS_DOMAIN_ID names, 0 without it.

    Raises:
        ValueError: ROS_DOMAIN_ID is no number from 0 to 232.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if not text.isdecimal() or int(text) > 232:
        raise ValueError(f"ROS_DOMAIN_ID is '{text}': a number from 0 to 232 expected")
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


def domain_configuration() -> str:
    """Cyclone DDS's XML: this machine only, unless ROS_AUTOMATIC_DISCOVERY_RANGE is SUBNET.

    Without multicast each participant is looked for at `localhost`, on the ports that an index
    from 0 to `MAX_PARTICIPANTS` gives: so `lo` is named and the index is `auto`. ROS 2 calls by
    multicast unless it is told otherwise, and that is not heard here: so that it is found even if
    it comes late, each participant keeps calling at all these ports.
    """
    interfaces = '<NetworkInterface name="lo"/>'
    if not _only_loopback():
        interfaces = '<NetworkInterface autodetermine="true"/>' + interfaces
    subnet = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST").upper() == "SUBNET"
    multicast = "" if subnet else "<AllowMulticast>false</AllowMulticast>"
    own = (
        f"<CycloneDDS><Domain><General><Interfaces>{interfaces}</Interfaces>{multicast}</General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MAX_PARTICIPANTS}</MaxAutoParticipantIndex>"
        f"<SPDPInterval>{_CALL_INTERVAL} s</SPDPInterval>"
        "<InitialLocatorPruneDelay>inf</InitialLocatorPruneDelay>"
        '<Peers><Peer address="localhost"/></Peers></Discovery></Domain></CycloneDDS>'
    )
    extra = os.environ.get("CYCLONEDDS_URI", "")
    return f"{own},{extra}" if extra else own


def join_domain(number: int) -> tuple[Domain, DomainParticipant]:
    """Creates the domain and a participant of a process without an enclave."""
    domain = Domain(number, domain_configuration())
    qos = Qos(Policy.Userdata(b"enclave=/;"))
    return domain, DomainParticipant(number, qos=qos)


def parse_user_data(qos: Qos) -> dict[str, str]:
    """Reads `key=value;key=value;` from an endpoint's USER_DATA."""
    data = qos[Policy.Userdata].data if Policy.Userdata in qos else b""
    pairs = (pair.split("=", 1) for pair in data.decode("ascii", "replace").split(";"))
    return {pair[0]: pair[1] for pair in pairs if len(pair) == 2}
