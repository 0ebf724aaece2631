"""The part of a node that looks at the graph."""

from __future__ import annotations

from typing import Any

from ros2_embedded import naming
from ros2_embedded.graph import Endpoint


class NodeGraph:
    """Methods of `Node` on what there is in the graph."""

    context: Any

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Full name of a topic, after remapping."""
        raise NotImplementedError

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Names and namespaces of all nodes; a node that was started twice is there twice."""
        return [(name, namespace) for name, namespace, _, _ in self.context.graph.nodes()]

    def get_node_names(self) -> list[str]:
        """Names of all nodes."""
        return [name for name, _ in self.get_node_names_and_namespaces()]

    def get_fully_qualified_node_names(self) -> list[str]:
        """Full names of all nodes."""
        return [naming.join(space, name) for name, space in self.get_node_names_and_namespaces()]

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:
        """Topics and their types."""
        return _listed(self.context.graph.topics())

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Services and their types."""
        return _listed(self.context.graph.services())

    def _of_node(self, name: str, namespace: str, writers: bool) -> list[Endpoint]:
        graph = self.context.graph
        guids: set[bytes] = set()
        for node_name, node_namespace, read, written in graph.nodes():
            if (node_name, node_namespace) == (name, namespace):
                guids.update(written if writers else read)
        return [endpoint for endpoint in graph.endpoints() if endpoint.guid in guids]

    def get_publisher_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> list[tuple[str, list[str]]]:
        """Topics that a node publishes."""
        return _listed(self.context.graph.topics(self._of_node(node_name, node_namespace, True)))

    def get_subscriber_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> list[tuple[str, list[str]]]:
        """Topics that a node subscribes to."""
        return _listed(self.context.graph.topics(self._of_node(node_name, node_namespace, False)))

    def get_service_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]:
        """Services that a node offers: it reads their requests."""
        read = self._of_node(node_name, node_namespace, False)
        requests = [e for e in read if e.topic.startswith(naming.REQUEST + "/")]
        return _listed(self.context.graph.services(requests))

    def get_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]:
        """Services that a node calls: it writes their requests."""
        written = self._of_node(node_name, node_namespace, True)
        requests = [e for e in written if e.topic.startswith(naming.REQUEST + "/")]
        return _listed(self.context.graph.services(requests))

    def get_publishers_info_by_topic(self, topic_name: str) -> list[Endpoint]:
        """Writers of a topic."""
        return list(self.context.graph.on_topic(self.resolve_topic_name(topic_name), True))

    def get_subscriptions_info_by_topic(self, topic_name: str) -> list[Endpoint]:
        """Readers of a topic."""
        return list(self.context.graph.on_topic(self.resolve_topic_name(topic_name), False))

    def count_publishers(self, topic_name: str) -> int:
        """Number of publishers on a topic."""
        return len(self.get_publishers_info_by_topic(topic_name))

    def count_subscribers(self, topic_name: str) -> int:
        """Number of subscriptions to a topic."""
        return len(self.get_subscriptions_info_by_topic(topic_name))


def _listed(names: dict[str, set[str]]) -> list[tuple[str, list[str]]]:
    return [(name, sorted(types)) for name, types in sorted(names.items())]
