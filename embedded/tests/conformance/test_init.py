"""Beginning and end: rclpy.init, contexts, shutdown, arguments; helpers, durations."""

import gc
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from builtin_interfaces.msg import Duration as DurationMessage
from builtin_interfaces.msg import Time as TimeMessage
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.duration import Duration, Infinite
from rclpy.exceptions import InvalidHandle, NotInitializedException, ROSInterruptException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.signals import SignalHandlerOptions, get_current_signal_handlers_options
from rclpy.time import Time
from rclpy.utilities import (
    get_default_context,
    get_rmw_implementation_identifier,
    remove_ros_args,
    timeout_sec_to_nsec,
)
from spinning import make, spin_until
from std_msgs.msg import String
from std_srvs.srv import Trigger


@pytest.fixture(autouse=True)
def _end() -> Iterator[None]:
    """Nothing is left of a test."""
    yield
    rclpy.try_shutdown()


def test_init_and_shutdown_have_an_order() -> None:
    """A node before init, init twice, shutdown before init and twice are errors."""
    assert not rclpy.ok()
    with pytest.raises(NotInitializedException) as early:
        Node("early")
    assert str(early.value) == "rclpy.init() has not been called. msg:cannot create node"
    with pytest.raises(RuntimeError, match="Context must be initialized before it can be shutdown"):
        rclpy.shutdown()
    rclpy.try_shutdown()
    rclpy.init(args=[])
    assert rclpy.ok()
    with pytest.raises(RuntimeError, match=r"Context.init\(\) must only be called once"):
        rclpy.init(args=[])
    assert rclpy.ok()
    rclpy.shutdown()
    assert not rclpy.ok()
    with pytest.raises(RuntimeError):
        rclpy.shutdown()
    with pytest.raises(NotInitializedException):
        rclpy.create_node("late")
    rclpy.init(args=[])
    assert rclpy.ok()


def test_the_default_context_is_replaced() -> None:
    """A context is used once: after a shutdown there is another."""
    first = get_default_context()
    assert get_default_context() is first
    rclpy.init(args=[])
    assert get_default_context() is first
    rclpy.shutdown()
    assert get_default_context() is not first
    with pytest.raises(RuntimeError, match="must only be called once"):
        first.init(args=[])
    with pytest.raises(RuntimeError, match="failed to shutdown"):
        first.shutdown()
    first.try_shutdown()


def test_contexts_of_ones_own() -> None:
    """They begin and end apart from the default one, and in domains of their own."""
    context = Context()
    with pytest.raises(RuntimeError, match="before it can have a domain id"):
        context.get_domain_id()
    with pytest.raises(RuntimeError, match="before it can be shutdown"):
        context.shutdown()
    rclpy.init(context=context, args=[], domain_id=99)
    assert context.ok()
    assert rclpy.ok(context=context)
    assert not rclpy.ok()
    assert context.get_domain_id() == 99
    node = Node("n", context=context)
    assert node.context is context
    rclpy.init(args=[])
    rclpy.shutdown(context=context)
    assert not context.ok()
    assert rclpy.ok()
    with pytest.raises(RuntimeError, match="should not be lower than zero"):
        Context().init(args=[], domain_id=-2)
    with pytest.raises(NotInitializedException):
        Node("n", context=Context())


def test_a_context_can_be_destroyed() -> None:
    """Before it is used nothing happens; after its shutdown it stays as it is."""
    context = Context()
    context.destroy()
    context.init(args=[])
    assert context.ok()
    context.shutdown()
    context.destroy()
    assert not context.ok()


def test_callbacks_at_the_shutdown() -> None:
    """Functions and methods are called once; too late means at once."""
    calls: list[str] = []

    class Owner:
        def called(self) -> None:
            calls.append("method")

    context, owner = Context(), Owner()
    context.on_shutdown(lambda: calls.append("function"))
    context.init(args=[])
    context.on_shutdown(owner.called)
    with pytest.raises(TypeError):
        context.on_shutdown(5)  # type: ignore[arg-type]
    context.shutdown()
    assert calls == ["function", "method"]
    context.on_shutdown(lambda: calls.append("late"))
    assert calls[2:] == ["late"]


def test_signal_handlers() -> None:
    """Installed for the default context, gone with it."""
    rclpy.init(args=[])
    assert get_current_signal_handlers_options() == SignalHandlerOptions.ALL
    rclpy.shutdown()
    assert get_current_signal_handlers_options() == SignalHandlerOptions.NO
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.SIGTERM)
    assert get_current_signal_handlers_options() == SignalHandlerOptions.SIGTERM
    rclpy.shutdown()
    context = Context()
    rclpy.init(args=[], context=context)
    assert get_current_signal_handlers_options() == SignalHandlerOptions.NO
    context.shutdown()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--nonsense"], r"\['--nonsense'\]"),
        (["-r", "a:=b", "--nonsense", "more"], r"\['--nonsense', 'more'\]"),
        (["-r", "nonsense"], "Couldn't parse remap rule: '-r nonsense'"),
        (["-r", "a b:=c"], "Couldn't parse remap rule: '-r a b:=c'"),
        (["-r", "__node:=a/b"], "Couldn't parse remap rule"),
        (["-r", "__ns:=relative"], "Couldn't parse remap rule"),
        (["--remap"], "Couldn't parse trailing --remap flag. No remap rule found."),
        (["-p", "nonsense"], "Couldn't parse parameter override rule: '-p nonsense'"),
        (["-p"], "Couldn't parse trailing -p flag. No parameter override rule found."),
        (["--params-file", "/nowhere.yaml"],
         "Couldn't parse params file: '--params-file /nowhere.yaml'"),
        (["--params-file"], "Couldn't parse trailing --params-file flag. No file path provided."),
        (["--log-level", "loud"], "Couldn't parse log level: '--log-level loud'. Error: "
                                  "Argument does not use a valid severity level"),
        (["--log-level"], "No log level provided"),
    ],
)  # fmt: skip
def test_bad_arguments(arguments: list[str], text: str) -> None:
    """They keep rclpy from beginning; it can begin afterwards."""
    with pytest.raises(RuntimeError, match=text):
        rclpy.init(args=["prog", "--ros-args", *arguments])
    assert not rclpy.ok()


def test_arguments_are_sorted_out() -> None:
    """What is between `--ros-args` and `--` is ROS's, however often."""
    line = ["prog", "a", "--ros-args", "-r", "x:=y", "--log-level", "info", "--", "b", "--ros-args",
            "-p", "p:=1", "--", "--nonsense", "--ros-args", "--disable-rosout-logs",
            "--enclave", "/"]  # fmt: skip
    assert remove_ros_args(line) == ["prog", "a", "b", "--nonsense"]
    assert remove_ros_args(["prog"]) == ["prog"]
    assert remove_ros_args([]) == []
    with pytest.raises(RuntimeError):
        remove_ros_args(["--ros-args", "--nonsense"])
    with pytest.raises(RuntimeError):
        remove_ros_args(["--ros-args", "-r", "nonsense"])


def test_after_the_end() -> None:
    """A destroyed publisher or client can do nothing, nor can one after the shutdown."""
    rclpy.init(args=[])
    node = Node("n")
    publisher, other = node.create_publisher(String, "x", 1), node.create_publisher(String, "y", 1)
    client = node.create_client(Trigger, "z")
    assert node.destroy_publisher(publisher)
    assert not node.destroy_publisher(publisher)
    assert not Node("m").destroy_publisher(other)
    assert node.destroy_client(client)
    for attempt in (
        lambda: publisher.publish(String()), publisher.get_subscription_count,
        lambda: publisher.topic_name, lambda: client.call_async(Trigger.Request()),
    ):  # fmt: skip
        with pytest.raises(InvalidHandle):
            attempt()
    rclpy.shutdown()
    with pytest.raises(RuntimeError, match="publisher's context is invalid"):
        other.publish(String())
    node.destroy_node()


def test_nothing_new_after_the_shutdown() -> None:
    """A node that outlives its context can make nothing, and says that the context is to blame."""
    rclpy.init(args=[])
    node = Node("n")
    rclpy.shutdown()
    for attempt in (
        lambda: node.create_publisher(String, "x", 1),
        lambda: node.create_subscription(String, "x", print, 1),
        lambda: node.create_service(Trigger, "y", print),
        lambda: node.create_client(Trigger, "y"),
        lambda: node.create_timer(1.0, print), lambda: node.create_rate(1.0),
        lambda: node.create_guard_condition(print),
        node.get_node_names, node.get_topic_names_and_types, lambda: node.count_publishers("x"),
    ):  # fmt: skip
        with pytest.raises(RuntimeError, match=r"context is (invalid|not valid)"):
            attempt()
    with pytest.raises(NotInitializedException):
        Node("m")


def test_what_a_node_has(executor: SingleThreadedExecutor) -> None:
    """Its publishers, subscriptions, services, clients and timers can be gone through."""
    node = make(executor, start_parameter_services=False)
    publisher = node.create_publisher(String, "x", 1)
    subscription = node.create_subscription(String, "x", print, 1)
    service = node.create_service(Trigger, "y", lambda _, response: response)
    client = node.create_client(Trigger, "y")
    timer = node.create_timer(60.0, print)
    assert list(node.publishers)[-1] is publisher
    assert [p.topic_name for p in node.publishers] == ["/parameter_events", "/x"]
    assert list(node.subscriptions) == [subscription]
    assert [s.service_name for s in node.services] == ["/tester/get_type_description", "/y"]
    assert list(node.services)[-1] is service
    assert list(node.clients) == [client]
    assert list(node.timers) == [timer]
    assert node.executor is executor
    node.executor = None
    assert executor.get_nodes() == []


def test_the_graph(executor: SingleThreadedExecutor) -> None:
    """What a node offers and uses, by its name; an unknown name is an error."""
    node = make(executor, "n", namespace="ns", start_parameter_services=False)
    node.create_subscription(String, "in", print, 1)
    node.create_service(Trigger, "serve", lambda _, response: response)
    node.create_client(Trigger, "call")
    kept = ("n", "/ns")
    assert spin_until(executor, lambda: kept in node.get_node_names_and_namespaces())
    assert spin_until(executor, lambda: len(node.get_client_names_and_types_by_node(*kept)) == 1)
    assert node.get_publisher_names_and_types_by_node(*kept) == [
        ("/parameter_events", ["rcl_interfaces/msg/ParameterEvent"]),
        ("/rosout", ["rcl_interfaces/msg/Log"]),
    ]
    assert node.get_subscriber_names_and_types_by_node(*kept) == [
        ("/ns/in", ["std_msgs/msg/String"])
    ]
    assert node.get_service_names_and_types_by_node(*kept) == [
        ("/ns/n/get_type_description", ["type_description_interfaces/srv/GetTypeDescription"]),
        ("/ns/serve", ["std_srvs/srv/Trigger"]),
    ]
    assert node.get_client_names_and_types_by_node(*kept) == [
        ("/ns/call", ["std_srvs/srv/Trigger"])
    ]
    # ROS 2's nodes of earlier tests may still be in the graph.
    assert [name for name in node.get_fully_qualified_node_names() if "ns" in name] == ["/ns/n"]
    assert (*kept, "/") in node.get_node_names_and_namespaces_with_enclaves()
    assert ("rt/ns/in", ["std_msgs::msg::dds_::String_"]) in node.get_topic_names_and_types(True)
    assert node.count_services("serve") == 1
    assert node.count_clients("/ns/call") == 1
    assert node.count_clients("serve") == 0
    assert node.wait_for_node("/ns/n", 5.0)
    assert not node.wait_for_node("nobody", 0.05)
    with pytest.raises(NodeNameNonExistentError):
        node.get_publisher_names_and_types_by_node("nobody", "/")
    for ask in (node.count_publishers, node.get_publishers_info_by_topic):
        with pytest.raises(ValueError, match="topic name 'a b' is invalid"):
            ask("a b")


def test_a_node_that_nothing_refers_to_leaves_the_graph(executor: SingleThreadedExecutor) -> None:
    """With all that it has, as if it had been destroyed; another of its name logs as ever."""
    watcher = make(executor, "watcher")
    logged: list[str] = []
    watcher.create_subscription(Log, "/rosout", lambda m: logged.append(m.msg), 10)

    def make_some() -> None:
        for _ in range(10):
            ghost = Node("ghost")
            ghost.create_subscription(String, "x", print, 1)
            ghost.create_publisher(String, "y", 1)
            ghost.create_timer(1.0, lambda: None)
            ghost.create_service(Trigger, "z", lambda _, response: response)

    make_some()

    def is_alone() -> bool:
        gc.collect()
        ends = watcher.count_subscribers("x") + watcher.count_publishers("y")
        return watcher.get_node_names() == ["watcher"] and not ends

    assert spin_until(executor, is_alone)
    node = make(executor, "ghost")

    def is_heard() -> bool:
        node.get_logger().info("here")
        return "here" in logged

    assert spin_until(executor, is_heard)


def test_helpers() -> None:
    """Timeouts in nanoseconds, the middleware's name, the interruption."""
    assert timeout_sec_to_nsec(None) == timeout_sec_to_nsec(-1.5) == -1
    assert timeout_sec_to_nsec(1.5) == 1_500_000_000
    assert get_rmw_implementation_identifier() == "rmw_cyclonedds_cpp"
    assert str(ROSInterruptException()) == "rclpy.shutdown() has been called"


def test_durations() -> None:
    """Made, compared, shown and sent."""
    duration = Duration(seconds=1.5, nanoseconds=2)
    assert duration.nanoseconds == 1_500_000_002
    assert repr(duration) == "Duration(nanoseconds=1500000002)"
    assert str(duration) == "1500000002 nanoseconds"
    assert str(Infinite) == "Infinite"
    assert Duration(seconds=-1) < Duration() <= Duration() < duration
    assert Duration(seconds=1) != 1
    assert Duration(seconds=-1.5).to_msg() == DurationMessage(sec=-2, nanosec=500_000_000)
    assert Duration.from_msg(DurationMessage(sec=1, nanosec=5)) == Duration(nanoseconds=10**9 + 5)
    for wrong in (TimeMessage(), 1):
        with pytest.raises(TypeError, match=r"Must pass a builtin_interfaces.msg.Duration object"):
            Duration.from_msg(wrong)
    with pytest.raises(OverflowError):
        Duration(seconds=1e10)
    with pytest.raises(TypeError):
        assert Duration() < 1  # type: ignore[operator]


@pytest.mark.parametrize(
    ("arguments", "error"),
    [({"seconds": -1}, ValueError), ({"nanoseconds": -1}, ValueError),
     ({"seconds": 1e10}, OverflowError), ({"clock_type": 7}, TypeError)],
)  # fmt: skip
def test_times_that_are_none(arguments: dict[str, Any], error: type[Exception]) -> None:
    """Negative, too large, of no clock."""
    with pytest.raises(error):
        Time(**arguments)


def test_times() -> None:
    """Differences are durations; nothing is before the beginning."""
    time = Time(seconds=2.5, nanoseconds=3)
    assert time.seconds_nanoseconds() == (2, 500_000_003)
    assert repr(time) == "Time(nanoseconds=2500000003, clock_type=SYSTEM_TIME)"
    assert time - Time(seconds=1) == Duration(seconds=1.5, nanoseconds=3)
    assert time + Duration(seconds=1) == Duration(seconds=1) + time == Time(nanoseconds=3500000003)
    assert (time - Duration(nanoseconds=3)).nanoseconds == 2_500_000_000
    assert time.to_msg() == TimeMessage(sec=2, nanosec=500_000_003)
    ros = Time.from_msg(TimeMessage(sec=2, nanosec=500_000_003))
    assert ros.clock_type.name == "ROS_TIME"
    with pytest.raises(TypeError, match="Can't compare times with different clock types"):
        assert ros == time
    with pytest.raises(TypeError, match="Can't subtract times with different clock types"):
        ros - time
    with pytest.raises(ValueError, match="Subtraction leads to negative time"):
        time - Duration(seconds=3)
    with pytest.raises(TypeError, match=r"Must pass a builtin_interfaces.msg.Time object"):
        Time.from_msg(DurationMessage())
    assert time != 5
