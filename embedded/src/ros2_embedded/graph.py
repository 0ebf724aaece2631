"""The graph: the nodes in the domain, with their topics and services.

DDS knows no nodes. Each participant publishes on the latched topic `ros_discovery_info` which
endpoints belong to which node. The endpoints are listed in Cyclone DDS's built-in topics.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.util import duration

from ros2_embedded import naming
from ros2_embedded.background import Background
from ros2_embedded.domain import parse_user_data
from ros2_embedded.fast_dds import Mismatch, is_fast_dds, mismatches, warnings
from ros2_embedded.messages import full_type_name, message_class
from ros2_embedded.samples import Sample, samples_of, write
from ros2_embedded.thread_safety import described, make_topic
from ros2_embedded.typehash import type_hash

_PUBLISH_DELAY = 0.02
"""Delay before publishing changes [s]: the endpoints of a node are mostly created together."""
_RETRY = 0.2
"""Delay before the next check [s]: nodes may be announced before their endpoints."""

_LATCHED = (
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.Durability.TransientLocal,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


@dataclass(frozen=True)
class Endpoint:
    """A writer or a reader anywhere in the domain."""

    guid: bytes
    participant: bytes
    topic: str
    type: str
    qos: Qos
    writer: bool


class NodeEntry:
    """A node of this process, with its endpoints' GUIDs."""

    def __init__(self, name: str, namespace: str) -> None:
        """Has no endpoints yet."""
        self.name, self.namespace = name, namespace
        self.readers: list[bytes] = []
        self.writers: list[bytes] = []

    @property
    def full_name(self) -> str:
        """Namespace and name."""
        return naming.join(self.namespace, self.name)


class Graph:
    """Publishes the nodes of this process, and keeps what is known of all nodes."""

    def __init__(self, participant: DomainParticipant, background: Background) -> None:
        """Starts to receive and to publish."""
        self._participant, self._background = participant, background
        self._lock = threading.RLock()
        self._nodes: list[NodeEntry] = []
        self._others: dict[bytes, Any] = {}
        self._endpoints: dict[bytes, Endpoint] = {}
        self._builtin: list[tuple[BuiltinDataReader, bool]] = []
        self._participant_reader: BuiltinDataReader | None = None
        self._told: set[Mismatch] = set()
        self.on_other_node: Callable[[str], None] = lambda full_name: None
        self.warn: Callable[[str, str], None] = lambda full_name, text: None
        info = message_class("rmw_dds_common/msg/ParticipantEntitiesInfo")
        topic = make_topic(participant, "ros_discovery_info", info)
        user_data = Policy.Userdata(f"typehash={type_hash(full_type_name(info))};".encode("ascii"))
        qos = Qos(
            *_LATCHED,
            user_data,
            Policy.History.KeepLast(1),
            Policy.DurabilityService(0, Policy.History.KeepLast(1), -1, -1, -1),
            Policy.WriterDataLifecycle(autodispose=False),
        )
        self._guid = participant.guid.bytes
        self._writer = DataWriter(participant, topic, qos)
        # The topic has no key: a history of one would keep one participant's news of all.
        ignore = Policy.IgnoreLocal.Participant
        reader_qos = Qos(*_LATCHED, user_data, Policy.History.KeepAll, ignore)
        self._reader = DataReader(participant, topic, reader_qos)
        background.add(samples_of(self._reader, self._on_info))

    # What this process has.

    def add_node(self, node: NodeEntry) -> None:
        """Adds a node of this process."""
        with self._lock:
            self._nodes.append(node)
        self.changed()

    def remove_node(self, node: NodeEntry) -> None:
        """Removes a node of this process."""
        with self._lock:
            if node in self._nodes:
                self._nodes.remove(node)
        self.changed()

    def changed(self) -> None:
        """Has the changes published soon."""
        self._background.call_later(_PUBLISH_DELAY, self._publish)

    def _publish(self) -> None:
        gid = message_class("rmw_dds_common/msg/Gid")
        entry = message_class("rmw_dds_common/msg/NodeEntitiesInfo")
        with self._lock:
            nodes = [
                entry(
                    node_name=node.name,
                    node_namespace=node.namespace,
                    reader_gid_seq=[gid(data=list(guid)) for guid in node.readers],
                    writer_gid_seq=[gid(data=list(guid)) for guid in node.writers],
                )
                for node in self._nodes
            ]
        info = self._writer.data_type
        news = info(gid=gid(data=list(self._guid)), node_entities_info_seq=nodes)
        write(self._writer, news.serialize())
        if any(map(is_fast_dds, self._others)):
            self._meet_fast_dds()

    # What others have.

    def _on_info(self, samples: list[Sample]) -> None:
        for data, _ in samples:
            info = self._writer.data_type.deserialize(data)
            key = bytes(info.gid.data)
            with self._lock:
                known = {_full_name(node) for node in self._entries(key)}
                self._others[key] = info
            for node in info.node_entities_info_seq:
                if _full_name(node) not in known:
                    self.on_other_node(_full_name(node))
            if is_fast_dds(key):
                self._background.call_later(0.0, self._meet_fast_dds)

    def _meet_fast_dds(self) -> None:
        """Warns, once of each, of services that cannot work."""
        topics = {endpoint.guid: endpoint.topic for endpoint in self.endpoints()}
        nodes = [
            (naming.join(space, name), read, written) for name, space, read, written in self.nodes()
        ]
        foreign = [node for node in nodes if any(map(is_fast_dds, node[1] + node[2]))]
        with self._lock:
            own = [(node.full_name, node.readers[:], node.writers[:]) for node in self._nodes]
        found = mismatches(own, foreign, topics) - self._told
        self._told |= found
        for full_name, text in warnings(found):
            self.warn(full_name, text)
        if any(guid not in topics for node in foreign for guid in node[1] + node[2]):
            self._background.call_later(_RETRY, self._meet_fast_dds)

    def _entries(self, participant: bytes) -> list[Any]:
        info = self._others.get(participant)
        return list(info.node_entities_info_seq) if info else []

    def endpoints(self) -> list[Endpoint]:
        """Every writer and reader that is known in the domain, at this moment."""
        with self._lock:
            if not self._builtin:
                for topic in (BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription):
                    reader = BuiltinDataReader(self._participant, topic)
                    self._builtin.append((reader, topic is BuiltinTopicDcpsPublication))
            for reader, writer in self._builtin:
                while samples := described(reader.take, 1000):
                    for sample in samples:
                        self._note(sample, writer)
            return list(self._endpoints.values())

    def _note(self, sample: Any, writer: bool) -> None:
        guid = sample.key.bytes
        info = sample.sample_info
        if not info.valid_data or info.instance_state != InstanceState.Alive:
            self._endpoints.pop(guid, None)
            return
        self._endpoints[guid] = Endpoint(
            guid,
            sample.participant_key.bytes,
            sample.topic_name,
            sample.type_name,
            sample.qos,
            writer,
        )

    def _alive(self) -> set[bytes]:
        """The participants that have endpoints; after its lease a killed process has none."""
        return {endpoint.participant for endpoint in self.endpoints()}

    def nodes(self) -> list[tuple[str, str, list[bytes], list[bytes]]]:
        """Name, namespace, readers and writers of every node; a name can be there twice."""
        alive = self._alive()
        with self._lock:
            found = [(n.name, n.namespace, n.readers[:], n.writers[:]) for n in self._nodes]
            for participant in list(self._others):
                if participant not in alive:
                    continue
                for node in self._entries(participant):
                    readers = [bytes(gid.data) for gid in node.reader_gid_seq]
                    writers = [bytes(gid.data) for gid in node.writer_gid_seq]
                    found.append((node.node_name, node.node_namespace, readers, writers))
        return found

    def is_complete(self) -> bool:
        """Whether all known participants have announced nodes, and all endpoints are known."""
        endpoints = {endpoint.guid for endpoint in self.endpoints()}
        told = {guid for node in self.nodes() for guid in node[2] + node[3]}
        with self._lock:
            silent = self._participants() - set(self._others) - {self._guid}
        return not silent and told <= endpoints

    def _participants(self) -> set[bytes]:
        """The participants of ROS 2, by their USER_DATA; it arrives before endpoints and nodes."""
        if self._participant_reader is None:
            self._participant_reader = BuiltinDataReader(
                self._participant, BuiltinTopicDcpsParticipant
            )
        return {
            sample.key.bytes
            for sample in described(self._participant_reader.read, 1000)
            if sample.sample_info.instance_state == InstanceState.Alive
            and "enclave" in parse_user_data(sample.qos)
        }

    def topics(self, endpoints: Iterable[Endpoint] | None = None) -> dict[str, set[str]]:
        """Topics and their types, of all endpoints or of the given ones."""
        return _collect(self.endpoints() if endpoints is None else endpoints, naming.demangle_topic)

    def services(self, endpoints: Iterable[Endpoint] | None = None) -> dict[str, set[str]]:
        """Services and their types, of all endpoints or of the given ones."""
        chosen = self.endpoints() if endpoints is None else endpoints
        return _collect(chosen, naming.demangle_service)


def _full_name(node: Any) -> str:
    return naming.join(node.node_namespace, node.node_name)


def _collect(
    endpoints: Iterable[Endpoint], demangle: Callable[[str, str], tuple[str, str] | None]
) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for endpoint in endpoints:
        pair = demangle(endpoint.topic, endpoint.type)
        if pair is not None:
            found.setdefault(pair[0], set()).add(pair[1])
    return found
