"""The parts of a node, in one place that no attribute of a subclass can hide."""

from __future__ import annotations

import weakref
from functools import partial
from typing import Any

from ros2_embedded import naming
from ros2_embedded.graph import Graph, NodeEntry

from rclpy.arguments import RosArguments, parse_arguments
from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.clock import ROSClock
from rclpy.exceptions import RCLError
from rclpy.logging import RcutilsLogger, get_logger
from rclpy.names import (
    expand_topic_name,
    validate_full_topic_name,
    validate_namespace,
    validate_node_name,
)
from rclpy.parameter_store import ParameterStore


class NodeHandle:
    """Name, namespace and everything that belongs to a node."""

    parameters: ParameterStore
    _end: weakref.finalize[Any, Any]

    def __init__(
        self, context: Any, name: str, namespace: str, cli_args: Any, use_global_arguments: bool
    ) -> None:
        """Settles the names after the command line's rules.

        Raises:
            InvalidNodeNameException: a name that ROS does not allow.
            InvalidNamespaceException: a namespace that ROS does not allow.
        """
        self.context = context
        own = parse_arguments(cli_args or [])
        shared = context.arguments if use_global_arguments else RosArguments()
        # The node's own rules go first: the first one that fits is taken.
        self.arguments = RosArguments(
            remaps=own.remaps + shared.remaps, parameters=shared.parameters + own.parameters
        )
        self._sources = (shared, own)
        validate_node_name(name)
        absolute = namespace if namespace.startswith("/") else f"/{namespace}"
        validate_namespace(absolute)
        self.name = self.arguments.node_name(name)
        self.namespace = self.arguments.namespace(self.name, absolute)
        self.full_name = naming.join(self.namespace, self.name)
        self.entry = NodeEntry(self.name, self.namespace)
        self.clock = ROSClock()
        self.logger: RcutilsLogger = get_logger(self.full_name.strip("/").replace("/", "."))
        self.default_callback_group: CallbackGroup = MutuallyExclusiveCallbackGroup()
        self.rate_group: CallbackGroup = ReentrantCallbackGroup()
        self._executor: weakref.ref[Any] | None = None
        self.entities: list[Any] = []
        self.publishers: list[Any] = []
        self.timers: list[Any] = []
        self.guards: list[Any] = []
        self.waitables: list[Any] = []
        self.services: list[Any] = []
        """The services of the node itself, which live as long as the node."""
        self.destroyed = False

    @property
    def executor(self) -> Any:
        """The executor that the node was added to last, or None; it is not kept alive."""
        return None if self._executor is None else self._executor()

    @executor.setter
    def executor(self, executor: Any) -> None:
        self._executor = None if executor is None else weakref.ref(executor)

    def all_entities(self) -> list[Any]:
        """All entities that an executor serves, without the timers."""
        own = [*self.entities, *self.guards]
        return own + [entity for waitable in self.waitables for entity in waitable.entities()]

    def enter_graph(self, node: Any) -> None:
        """Adds the node to the graph, until it is destroyed or nothing refers to it any more."""
        graph, background = self.context.graph, self.context.background
        graph.add_node(self.entry)
        self.context.nodes.add(node)
        self._end = background.call_when_gone(node, partial(graph.remove_node, self.entry))

    def destroy(self, node: Any) -> None:
        """Destroys all entities of the node, and removes it from the graph."""
        if self.destroyed:
            return
        self.destroyed = True
        if self.executor is not None:
            self.executor.remove_node(node)
        for waitable in list(self.waitables):
            waitable.destroy()
        owned = (self.services, self.entities, self.guards, self.publishers, self.timers)
        for thing in [thing for things in owned for thing in things]:
            thing.destroy()
        self.services, self.entities, self.guards = [], [], []
        self.publishers, self.timers = [], []
        self._end.detach()
        if (graph := self.context.graph) is not None:
            graph.remove_node(self.entry)
        self.context.nodes.discard(node)

    @property
    def graph(self) -> Graph:
        """The graph of the domain; raises RCLError after the shutdown."""
        with self.context.staying("read the graph"):
            known: Graph = self.context.graph
            return known

    def __enter__(self) -> NodeHandle:
        """For `with node.handle:`, which programs for rclpy may have."""
        return self

    def __exit__(self, *_: object) -> None:
        """Does nothing."""

    def overrides(self) -> dict[str, Any]:
        """Values of parameters from the command line: what is for this node only comes last."""
        values: dict[str, Any] = {}
        for source in self._sources:
            values.update(source.parameters_for(self.full_name))
        return values

    def resolve(self, name: str, kind: str, only_expand: bool) -> str:
        """Full name of a `topic` or a `service`, after remapping.

        Raises:
            RCLError: the name is not valid.
        """
        try:
            full = expand_topic_name(name, self.name, self.namespace)
            if not only_expand:
                full = self.arguments.remap(full, self.name, self.namespace, kind)
            validate_full_topic_name(full)
        except Exception as error:
            raise RCLError(f"failed to resolve name: {error}") from error
        return full
