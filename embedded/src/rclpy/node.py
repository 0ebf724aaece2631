"""Nodes."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from typing import Any

from ros2_embedded import naming
from ros2_embedded.graph import NodeEntry

from rclpy.arguments import RosArguments, parse_arguments
from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.clock import Clock, ROSClock
from rclpy.context import Context, get_default_context
from rclpy.duration import S_TO_NS
from rclpy.entity import Entity
from rclpy.guard_condition import GuardCondition
from rclpy.logging import RcutilsLogger
from rclpy.node_graph import NodeGraph
from rclpy.node_parameters import NodeParameters
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService
from rclpy.parameter_store import ParameterStore
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, as_profile, qos_profile_services_default
from rclpy.service import Client, Service
from rclpy.subscription import Subscription
from rclpy.time_source import TimeSource
from rclpy.timer import Rate, Timer


class Node(NodeParameters, NodeGraph):
    """A node: the owner of publishers, subscriptions, services, clients, timers and parameters."""

    def __init__(
        self,
        node_name: str,
        *,
        context: Context | None = None,
        cli_args: Sequence[str] | None = None,
        namespace: str | None = None,
        use_global_arguments: bool = True,
        enable_rosout: bool = True,
        start_parameter_services: bool = True,
        parameter_overrides: Sequence[Parameter] | None = None,
        allow_undeclared_parameters: bool = False,
        automatically_declare_parameters_from_overrides: bool = False,
    ) -> None:
        """Creates the node and its parameter services.

        Raises:
            NotInitializedException: before `rclpy.init()`.
            InvalidNameError: a name that ROS 2 does not allow.
        """
        self.context = context or get_default_context()
        self.context.require_ok()
        own = parse_arguments(cli_args or [])
        shared = self.context.arguments if use_global_arguments else RosArguments()
        # The node's own arguments go first: the first rule that fits is taken.
        self._arguments = RosArguments(
            remaps=own.remaps + shared.remaps, parameters=shared.parameters + own.parameters
        )
        name = self._arguments.node_name(node_name)
        naming.check_node_name(name)
        self._namespace = naming.normalise_namespace(
            self._arguments.namespace(node_name, namespace or "/")
        )
        self._name = name
        self.__executor: weakref.ref[Any] | None = None
        self.__rate_group = ReentrantCallbackGroup()
        self.default_callback_group: CallbackGroup = MutuallyExclusiveCallbackGroup()
        self._entities: list[Entity] = []
        self._publishers: list[Publisher] = []
        self.timers_list: list[Timer] = []
        self._waitables: list[Any] = []
        self._clock = ROSClock()
        full_name = naming.join(self._namespace, name)
        self._logger = RcutilsLogger(full_name.strip("/").replace("/", "."), self._clock)
        self.entry = NodeEntry(name, self._namespace)
        overrides = self._arguments.parameters_for(full_name)
        overrides.update({p.name: p.value for p in parameter_overrides or ()})
        self._parameters = ParameterStore(overrides, allow_undeclared_parameters)
        self._destroyed = False
        self.__time_source = TimeSource(self, self._clock)
        self.context.graph.add_node(self.entry)
        self.context.nodes.add(self)
        if automatically_declare_parameters_from_overrides:
            self.declare_parameters("", [(key, value) for key, value in overrides.items()])
        self._parameters.post_callbacks.append(self.__time_source.follow)
        if not self.has_parameter("use_sim_time"):
            self.declare_parameter("use_sim_time", False)
        self.__time_source.follow([self.get_parameter("use_sim_time")])
        if start_parameter_services:
            self._parameter_service = ParameterService(self, self._parameters)

    @property
    def executor(self) -> Any:
        """The executor that it was added to last; None if there is none."""
        return None if self.__executor is None else self.__executor()

    @executor.setter
    def executor(self, new_executor: Any) -> None:
        current = self.executor
        if current is new_executor:
            return
        if current is not None:
            current.remove_node(self)
        self.__executor = None
        if new_executor is not None:
            new_executor.add_node(self)
            self.__executor = weakref.ref(new_executor)

    # Names.

    def get_name(self) -> str:
        """Name without the namespace."""
        return self._name

    def get_namespace(self) -> str:
        """Namespace, `/` at least."""
        return self._namespace

    def get_fully_qualified_name(self) -> str:
        """Namespace and name."""
        return naming.join(self._namespace, self._name)

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Full name of a topic, after remapping."""
        if only_expand:
            return naming.expand(topic, self._name, self._namespace)
        return self._arguments.resolve(topic, self._name, self._namespace)

    resolve_service_name = resolve_topic_name

    def get_logger(self) -> RcutilsLogger:
        """The node's logger."""
        return self._logger

    def get_clock(self) -> ROSClock:
        """The node's clock: simulated if `use_sim_time` is set."""
        return self._clock

    # What the node has.

    def create_publisher(
        self, msg_type: Any, topic: str, qos_profile: QoSProfile | int, **_: Any
    ) -> Publisher:
        """Creates a publisher; `qos_profile` may be a depth."""
        name = self.resolve_topic_name(topic)
        publisher = Publisher(self, msg_type, name, as_profile(qos_profile))
        self._publishers.append(publisher)
        return publisher

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[[Any], Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        raw: bool = False,
        **_: Any,
    ) -> Subscription:
        """Creates a subscription; `qos_profile` may be a depth, `raw` messages are bytes of CDR."""
        name = self.resolve_topic_name(topic)
        qos = as_profile(qos_profile)
        return self._keep(Subscription(self, msg_type, name, callback, qos, callback_group, raw))

    def create_service(
        self,
        srv_type: Any,
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Service:
        """Creates a service; `callback(request, response)` returns the response."""
        return self._keep(Service(self, srv_type, srv_name, callback, qos_profile, callback_group))

    def create_client(
        self,
        srv_type: Any,
        srv_name: str,
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Client:
        """Creates a client of a service."""
        return self._keep(Client(self, srv_type, srv_name, qos_profile, callback_group))

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], Any],
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Creates a timer on the node's clock, or on another one."""
        group = callback_group or self.default_callback_group
        timer = Timer(
            callback, group, int(float(timer_period_sec) * S_TO_NS), clock or self._clock,
            context=self.context, autostart=autostart,
        )  # fmt: skip
        timer.node = self
        group.add_entity(timer)
        self.timers_list = [*self.timers_list, timer]  # the executor may be going through the list
        timer.requeue()
        return timer

    def create_guard_condition(
        self, callback: Callable[[], Any], callback_group: CallbackGroup | None = None
    ) -> GuardCondition:
        """Creates a guard condition: its `trigger` has the executor call `callback`."""
        return self._keep(GuardCondition(self, callback, callback_group))

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:
        """Creates a rate: its `sleep` waits for the next beat of a timer of `frequency` [Hz].

        Raises:
            ValueError: a frequency that is not positive.
        """
        if frequency <= 0:
            raise ValueError("frequency must be > 0")
        timer = self.create_timer(1.0 / frequency, _no_callback, self.__rate_group, clock)
        return Rate(timer, context=self.context)

    def _keep(self, entity: Any) -> Any:
        self._entities.append(entity)
        entity.wake()
        return entity

    def add_waitable(self, waitable: Any) -> None:
        """Keeps an action's server or client: it has entities, and ends with the node."""
        self._waitables.append(waitable)
        for entity in waitable.entities():
            entity.wake()

    def remove_waitable(self, waitable: Any) -> None:
        """Forgets an action's server or client."""
        if waitable in self._waitables:
            self._waitables.remove(waitable)

    def entities(self) -> list[Entity]:
        """What an executor works on, without the timers."""
        return [*self._entities, *(e for w in self._waitables for e in w.entities())]

    @property
    def publishers(self) -> list[Publisher]:
        """The publishers."""
        return list(self._publishers)

    @property
    def subscriptions(self) -> list[Subscription]:
        """The subscriptions."""
        return [entity for entity in self._entities if isinstance(entity, Subscription)]

    @property
    def timers(self) -> list[Timer]:
        """The timers."""
        return list(self.timers_list)

    def _destroy(self, owner: list[Any], thing: Any) -> bool:
        if thing not in owner:
            return False
        owner.remove(thing)
        thing.destroy()
        return True

    def destroy_publisher(self, publisher: Publisher) -> bool:
        """Ends a publisher; whether it was the node's."""
        return self._destroy(self._publishers, publisher)

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """Ends a subscription; whether it was the node's."""
        return self._destroy(self._entities, subscription)

    def destroy_service(self, service: Service) -> bool:
        """Ends a service; whether it was the node's."""
        return self._destroy(self._entities, service)

    def destroy_client(self, client: Client) -> bool:
        """Ends a client; whether it was the node's."""
        return self._destroy(self._entities, client)

    def destroy_timer(self, timer: Timer) -> bool:
        """Ends a timer; whether it was the node's."""
        if timer not in self.timers_list:
            return False
        self.timers_list = [other for other in self.timers_list if other is not timer]
        timer.destroy()
        return True

    def destroy_guard_condition(self, guard: GuardCondition) -> bool:
        """Ends a guard condition; whether it was the node's."""
        return self._destroy(self._entities, guard)

    def destroy_rate(self, rate: Rate) -> bool:
        """Ends a rate; whether it was the node's."""
        known = self.destroy_timer(rate.timer)
        rate.destroy()
        return known

    def destroy_node(self) -> None:
        """Ends the node and all that it has; once more does nothing."""
        if self._destroyed:
            return
        self._destroyed = True
        if self.executor is not None:
            self.executor.remove_node(self)
        for waitable in list(self._waitables):
            waitable.destroy()
        things: list[Any] = [*self._entities, *self._publishers, *self.timers_list]
        for thing in things:
            thing.destroy()
        self._entities, self._publishers, self.timers_list = [], [], []
        if self.context.graph is not None:
            self.context.graph.remove_node(self.entry)
        self.context.nodes.discard(self)


def _no_callback() -> None:
    """Stands for the callback that a rate gives its timer."""
