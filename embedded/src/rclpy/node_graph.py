"""The part of a node that looks at the graph."""

from __future__ import annotations

import time
from typing import Any

from ros2_embedded import naming
from ros2_embedded.domain import parse_user_data
from ros2_embedded.graph import Endpoint

from rclpy.exceptions import NodeNameNonExistentError
from rclpy.names import expand_topic_name, validate_full_topic_name
from rclpy.qos_dds import from_dds
from rclpy.topic_endpoint_info import TopicEndpointInfo, TopicEndpointTypeEnum
from rclpy.type_hash import TypeHash

NamesAndTypes = list[tuple[str, list[str]]]
_POLL = 0.1
_UNKNOWN = ("_NODE_NAME_UNKNOWN_", "_NODE_NAMESPACE_UNKNOWN_")


class NodeGraph:
    """Methods of `Node` on what there is in the graph."""

    handle: Any

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Names and namespaces of all nodes; a node that was started twice is there twice."""
        return [(name, space) for name, space, _, _ in self.handle.graph.nodes()]

    def get_node_names_and_namespaces_with_enclaves(self) -> list[tuple[str, str, str]]:
        """Names, namespaces and enclaves of all nodes."""
        return [(name, space, "/") for name, space in self.get_node_names_and_namespaces()]

    def get_node_names(self) -> list[str]:
        """Names of all nodes."""
        return [name for name, _ in self.get_node_names_and_namespaces()]

    def get_fully_qualified_node_names(self) -> list[str]:
        """Full names of all nodes."""
        return [naming.join(space, name) for name, space in self.get_node_names_and_namespaces()]

    def get_topic_names_and_types(self, no_demangle: bool = False) -> NamesAndTypes:
        """Topics and their types, as ROS names them or DDS."""
        return _topics(self.handle, None, no_demangle)

    def get_service_names_and_types(self) -> NamesAndTypes:
        """Services and their types."""
        return _listed(self.handle.graph.services())

    def get_publisher_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> NamesAndTypes:
        """Topics that a node publishes."""
        return _topics(
            self.handle, _of_node(self.handle, node_name, node_namespace, True), no_demangle
        )

    def get_subscriber_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> NamesAndTypes:
        """Topics that a node subscribes to."""
        return _topics(
            self.handle, _of_node(self.handle, node_name, node_namespace, False), no_demangle
        )

    def get_service_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Services that a node offers: it reads their requests."""
        return _requests(self.handle, _of_node(self.handle, node_name, node_namespace, False))

    def get_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Services that a node calls: it writes their requests."""
        return _requests(self.handle, _of_node(self.handle, node_name, node_namespace, True))

    def get_publishers_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        """The publishers of a topic; with `no_mangle` the name is that of the DDS topic."""
        return _infos(self.handle, topic_name, no_mangle, True)

    def get_subscriptions_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        """The subscriptions of a topic; with `no_mangle` the name is that of the DDS topic."""
        return _infos(self.handle, topic_name, no_mangle, False)

    def count_publishers(self, topic_name: str) -> int:
        """Number of publishers on a topic; its name is not remapped."""
        return _count(self.handle, naming.topic_name(_full(self.handle, topic_name)), True)

    def count_subscribers(self, topic_name: str) -> int:
        """Number of subscriptions to a topic; its name is not remapped."""
        return _count(self.handle, naming.topic_name(_full(self.handle, topic_name)), False)

    def count_clients(self, service_name: str) -> int:
        """Number of clients of a service; its name is not remapped."""
        full = _full(self.handle, service_name, is_service=True)
        return _count(self.handle, naming.request_name(full), True)

    def count_services(self, service_name: str) -> int:
        """Number of servers of a service; its name is not remapped."""
        full = _full(self.handle, service_name, is_service=True)
        return _count(self.handle, naming.request_name(full), False)

    def wait_for_node(self, fully_qualified_node_name: str, timeout: float) -> bool:
        """Waits until there is a node of that name; False if it did not come in time [s]."""
        name = "/" + fully_qualified_node_name.removeprefix("/")
        deadline = time.monotonic() + timeout
        while name not in self.get_fully_qualified_node_names():
            if time.monotonic() >= deadline:
                return False
            time.sleep(_POLL)
        return True


def _full(handle: Any, name: str, *, is_service: bool = False) -> str:
    full = expand_topic_name(name, handle.name, handle.namespace)
    validate_full_topic_name(full, is_service=is_service)
    return full


def _count(handle: Any, topic: str, writers: bool) -> int:
    found = handle.graph.endpoints()
    return sum(end.topic == topic and end.writer == writers for end in found)


def _of_node(handle: Any, name: str, namespace: str, writers: bool) -> list[Endpoint]:
    graph = handle.graph
    nodes = [node for node in graph.nodes() if node[:2] == (name, namespace)]
    if not nodes:
        raise NodeNameNonExistentError(f"There is no node {naming.join(namespace, name)}")
    guids = {guid for _, _, read, written in nodes for guid in (written if writers else read)}
    return [endpoint for endpoint in graph.endpoints() if endpoint.guid in guids]


def _topics(handle: Any, endpoints: list[Endpoint] | None, plain: bool) -> NamesAndTypes:
    graph = handle.graph
    if not plain:
        return _listed(graph.topics(endpoints))
    names: dict[str, set[str]] = {}
    for endpoint in graph.endpoints() if endpoints is None else endpoints:
        names.setdefault(endpoint.topic, set()).add(endpoint.type)
    return _listed(names)


def _requests(handle: Any, endpoints: list[Endpoint]) -> NamesAndTypes:
    requests = [end for end in endpoints if end.topic.startswith(naming.REQUEST + "/")]
    return _listed(handle.graph.services(requests))


def _infos(handle: Any, name: str, plain: bool, writers: bool) -> list[TopicEndpointInfo]:
    topic = name
    if not plain:
        full = handle.arguments.remap(_full(handle, name), handle.name, handle.namespace)
        topic = naming.topic_name(full)
    graph = handle.graph
    found = [end for end in graph.endpoints() if (end.topic, end.writer) == (topic, writers)]
    owners = {
        guid: (name, namespace)
        for name, namespace, read, written in (graph.nodes() if found else ())
        for guid in (written if writers else read)
    }
    kind = TopicEndpointTypeEnum.PUBLISHER if writers else TopicEndpointTypeEnum.SUBSCRIPTION
    return [_info(end, owners.get(end.guid, _UNKNOWN), kind) for end in found]


def _info(end: Endpoint, owner: tuple[str, str], kind: TopicEndpointTypeEnum) -> TopicEndpointInfo:
    return TopicEndpointInfo(
        node_name=owner[0],
        node_namespace=owner[1],
        topic_type=naming.ros_type(end.type),
        topic_type_hash=TypeHash.from_text(parse_user_data(end.qos).get("typehash", "")),
        endpoint_type=kind,
        endpoint_gid=list(end.guid),
        qos_profile=from_dds(end.qos),
    )


def _listed(names: dict[str, set[str]]) -> NamesAndTypes:
    return [(name, sorted(types)) for name, types in sorted(names.items())]
