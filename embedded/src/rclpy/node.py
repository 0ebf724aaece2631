"""Nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ROSClock
from rclpy.context import Context, get_default_context
from rclpy.duration import S_TO_NS
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import NodeNameNonExistentError as NodeNameNonExistentError
from rclpy.exceptions import NotInitializedException, RCLError
from rclpy.guard_condition import GuardCondition
from rclpy.logging import RcutilsLogger
from rclpy.names import expand_topic_name, validate_full_topic_name, validate_topic_name
from rclpy.node_graph import NodeGraph
from rclpy.node_handle import NodeHandle
from rclpy.node_parameters import NodeParameters
from rclpy.node_services import start_node_services
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, as_profile, qos_profile_services_default
from rclpy.qos_overriding_options import QoSOverridingOptions, override_qos
from rclpy.service import Client, Service
from rclpy.subscription import Subscription
from rclpy.timer import Rate, Timer
from rclpy.type_support import check_is_valid_msg_type, check_is_valid_srv_type


class Node(NodeParameters, NodeGraph):
    """A node: the owner of publishers, subscriptions, services, clients, timers and parameters.

    Its parts are in `handle`: a subclass may use all names of attributes that rclpy's Node lacks.
    """

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
        enable_logger_service: bool = False,
    ) -> None:
        """Creates the node and its services.

        Raises:
            NotInitializedException: before `rclpy.init()`.
            InvalidNodeNameException: a name that ROS does not allow.
            InvalidNamespaceException: a namespace that ROS does not allow.
        """
        chosen = get_default_context() if context is None else context
        if not chosen.ok():
            raise NotInitializedException("cannot create node")
        handle = NodeHandle(chosen, node_name, namespace or "", cli_args, use_global_arguments)
        self.__handle = handle
        with chosen.staying("create node"):
            handle.enter_graph(self)
            start_node_services(
                self,
                overrides=parameter_overrides or (),
                rosout=enable_rosout,
                parameter_services=start_parameter_services,
                logger_service=enable_logger_service,
                allow_undeclared=allow_undeclared_parameters,
                declare_overrides=automatically_declare_parameters_from_overrides,
            )

    @property
    def handle(self) -> NodeHandle:  # type: ignore[override]
        """The parts of the node, for rclpy itself."""
        return self.__handle

    @property
    def context(self) -> Context:
        """The context that it belongs to."""
        return self.__handle.context

    @property
    def default_callback_group(self) -> CallbackGroup:
        """The group of what is given no other."""
        return self.__handle.default_callback_group

    @property
    def executor(self) -> Any:
        """The executor that the node was added to last, or None."""
        return self.__handle.executor

    @executor.setter
    def executor(self, new_executor: Any) -> None:
        handle = self.__handle
        current = handle.executor
        if current is new_executor:
            return
        handle.executor = None
        if current is not None:
            current.remove_node(self)
        if new_executor is not None:
            new_executor.add_node(self)
            handle.executor = new_executor

    # Names.

    def get_name(self) -> str:
        """Name without the namespace."""
        return self.__handle.name

    def get_namespace(self) -> str:
        """Namespace, `/` at least."""
        return self.__handle.namespace

    def get_fully_qualified_name(self) -> str:
        """Namespace and name."""
        return self.__handle.full_name

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Full name of a topic, after remapping unless `only_expand`."""
        return self.__handle.resolve(topic, "topic", only_expand)

    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str:
        """Full name of a service, after remapping unless `only_expand`."""
        return self.__handle.resolve(service, "service", only_expand)

    def get_logger(self) -> RcutilsLogger:
        """The node's logger."""
        return self.__handle.logger

    def get_clock(self) -> ROSClock:
        """The node's clock: simulated if `use_sim_time` is set."""
        return self.__handle.clock

    # What the node has.

    def create_publisher(
        self,
        msg_type: Any,
        topic: str,
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        publisher_class: type[Publisher] = Publisher,
    ) -> Publisher:
        """Creates a publisher; `qos_profile` may be a depth."""
        qos = as_profile(qos_profile)
        full = _resolved(self, topic, False)
        override_qos(self, "publisher", full, qos, qos_overriding_options)
        check_is_valid_msg_type(msg_type)
        with self.context.staying("create publisher"):
            publisher = publisher_class(
                self, msg_type, topic, qos, event_callbacks or PublisherEventCallbacks(),
                callback_group or self.default_callback_group,
            )  # fmt: skip
        self.__handle.publishers.append(publisher)
        return publisher

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[..., Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> Subscription:
        """Creates a subscription; `qos_profile` may be a depth, `raw` messages are bytes of CDR."""
        qos = as_profile(qos_profile)
        full = _resolved(self, topic, False)
        override_qos(self, "subscription", full, qos, qos_overriding_options)
        check_is_valid_msg_type(msg_type)
        group = callback_group or self.default_callback_group
        events = event_callbacks or SubscriptionEventCallbacks()
        with self.context.staying("create subscription"):
            made = Subscription(self, msg_type, topic, callback, qos, group, raw, events)
        return _kept(self, made)

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
        check_is_valid_srv_type(srv_type)
        _resolved(self, srv_name, True)
        with self.context.staying("create service"):
            made = Service(self, srv_type, srv_name, callback, qos_profile, callback_group)
        return _kept(self, made)

    def create_client(
        self,
        srv_type: Any,
        srv_name: str,
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Client:
        """Creates a client of a service."""
        check_is_valid_srv_type(srv_type)
        _resolved(self, srv_name, True)
        with self.context.staying("create client"):
            made = Client(self, srv_type, srv_name, qos_profile, callback_group)
        return _kept(self, made)

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], Any],
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Creates a timer on the node's clock, or on another one."""
        handle = self.__handle
        group = callback_group or handle.default_callback_group
        timer = Timer(
            callback, group, int(float(timer_period_sec) * S_TO_NS), clock or handle.clock,
            context=handle.context, autostart=autostart,
        )  # fmt: skip
        timer.node = self
        group.add_entity(timer)
        handle.timers = [*handle.timers, timer]  # the executor may be going through the list
        timer.requeue()
        return timer

    def create_guard_condition(
        self, callback: Callable[[], Any], callback_group: CallbackGroup | None = None
    ) -> GuardCondition:
        """Creates a guard condition: its `trigger` has the executor call `callback`."""
        guard = GuardCondition(self, callback, callback_group)
        self.__handle.guards.append(guard)
        return guard

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:
        """Creates a rate: its `sleep` waits for the next beat of a timer of `frequency` [Hz].

        Raises:
            ValueError: a frequency that is not positive.
        """
        if frequency <= 0:
            raise ValueError("frequency must be > 0")
        group = self.__handle.rate_group
        timer = self.create_timer(1.0 / frequency, _no_callback, group, clock)
        return Rate(timer, context=self.context)

    def add_waitable(self, waitable: Any) -> None:
        """Keeps an action's server or client: it has entities, and ends with the node."""
        self.__handle.waitables.append(waitable)
        for entity in waitable.entities():
            _offer(self, entity)

    def remove_waitable(self, waitable: Any) -> None:
        """Forgets an action's server or client."""
        if waitable in self.__handle.waitables:
            self.__handle.waitables.remove(waitable)

    @property
    def publishers(self) -> Iterator[Publisher]:
        """The publishers."""
        yield from self.__handle.publishers

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """The subscriptions."""
        yield from _of_kind(self, Subscription)

    @property
    def clients(self) -> Iterator[Client]:
        """The clients of services."""
        yield from _of_kind(self, Client)

    @property
    def services(self) -> Iterator[Service]:
        """The services."""
        yield from _of_kind(self, Service)

    @property
    def timers(self) -> Iterator[Timer]:
        """The timers."""
        yield from self.__handle.timers

    @property
    def guards(self) -> Iterator[GuardCondition]:
        """The guard conditions."""
        yield from self.__handle.guards

    @property
    def waitables(self) -> Iterator[Any]:
        """The actions' servers and clients."""
        yield from self.__handle.waitables

    def destroy_publisher(self, publisher: Publisher) -> bool:
        """Ends a publisher; whether it was the node's."""
        return _destroyed(self.__handle.publishers, publisher)

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """Ends a subscription; whether it was the node's."""
        return _destroyed(self.__handle.entities, subscription)

    def destroy_service(self, service: Service) -> bool:
        """Ends a service; whether it was the node's."""
        return _destroyed(self.__handle.entities, service)

    def destroy_client(self, client: Client) -> bool:
        """Ends a client; whether it was the node's."""
        return _destroyed(self.__handle.entities, client)

    def destroy_timer(self, timer: Timer) -> bool:
        """Ends a timer; whether it was the node's."""
        handle = self.__handle
        if timer not in handle.timers:
            return False
        timer.destroy()
        handle.timers = [other for other in handle.timers if other is not timer]
        return True

    def destroy_guard_condition(self, guard: GuardCondition) -> bool:
        """Ends a guard condition; whether it was the node's."""
        return _destroyed(self.__handle.guards, guard)

    def destroy_rate(self, rate: Rate) -> bool:
        """Ends a rate; whether it was the node's."""
        known = self.destroy_timer(rate.timer)
        rate.destroy()
        return known

    def destroy_node(self) -> None:
        """Destroys the node and all its entities; a second call does nothing."""
        self.__handle.destroy(self)


def _no_callback() -> None:
    """The callback of a rate's timer, which does nothing."""


def _resolved(node: Node, name: str, is_service: bool) -> str:
    """Full name of a topic or a service; the error for a wrong name points at what is wrong."""
    try:
        if is_service:
            return node.resolve_service_name(name)
        return node.resolve_topic_name(name)
    except RCLError:
        validate_topic_name(name, is_service=is_service)
        full = expand_topic_name(name, node.get_name(), node.get_namespace())
        validate_full_topic_name(full, is_service=is_service)
        raise


def _kept(node: Node, entity: Any) -> Any:
    node.handle.entities.append(entity)
    _offer(node, entity)
    return entity


def _offer(node: Node, entity: Any) -> None:
    if node.executor is not None:
        node.executor.watch(entity)


def _of_kind(node: Node, kind: type) -> list[Any]:
    return [entity for entity in node.handle.entities if isinstance(entity, kind)]


def _destroyed(owner: list[Any], thing: Any) -> bool:
    if thing not in owner:
        return False
    owner.remove(thing)
    thing.destroy()
    return True
