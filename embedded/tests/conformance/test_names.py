"""Names of nodes, namespaces, topics and services; remapping; what a node's subclass may define."""

from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidServiceNameException,
    InvalidTopicNameException,
    NameValidationException,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from spinning import make, result, spin_until
from std_msgs.msg import String
from std_srvs.srv import Trigger


@pytest.fixture
def arguments() -> Iterator[Any]:
    """Initialises rclpy with ROS arguments."""
    yield lambda *items: rclpy.init(args=["prog", "--ros-args", *items])
    rclpy.try_shutdown()


@pytest.mark.usefixtures("executor")
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("", "Invalid node name: node name must not be empty:\n  ''\n   ^"),
        ("a b", "Invalid node name: node name must not contain characters other than "
                "alphanumerics or '_':\n  'a b'\n    ^"),
        ("a/b", "alphanumerics or '_'"), ("é", "alphanumerics or '_'"),
        ("1a", "node name must not start with a number:\n  '1a'\n   ^"),
        ("a" * 256, "node name length should not exceed '255'"),
    ],
)  # fmt: skip
def test_bad_node_names(name: str, text: str) -> None:
    """The error tells what is wrong and points at it."""
    with pytest.raises(InvalidNodeNameException) as caught:
        Node(name)
    assert text in str(caught.value)
    assert isinstance(caught.value, NameValidationException)


@pytest.mark.usefixtures("executor")
@pytest.mark.parametrize(
    ("space", "text"),
    [
        ("a//b", "Invalid namespace: namespace must not contain repeated '/':\n  '/a//b'\n      ^"),
        ("a/", "namespace must not end with a '/', unless only a '/':\n  '/a/'\n     ^"),
        ("/1a", "namespace must not have a token that starts with a number:\n  '/1a'\n    ^"),
        ("/a b", "namespace must not contain characters other than alphanumerics, '_', or '/'"),
    ],
)
def test_bad_namespaces(space: str, text: str) -> None:
    """The error shows the namespace with its leading slash."""
    with pytest.raises(InvalidNamespaceException) as caught:
        Node("a", namespace=space)
    assert text in str(caught.value)


@pytest.mark.usefixtures("executor")
@pytest.mark.parametrize(
    ("given", "full"), [(None, "/n"), ("", "/n"), ("/", "/n"), ("a", "/a/n"), ("/a/b", "/a/b/n")]
)
def test_namespaces_become_absolute(given: str | None, full: str) -> None:
    """The leading slash may be left out."""
    node = Node("n", namespace=given)
    assert node.get_fully_qualified_name() == full
    assert node.get_namespace() == full.rpartition("/")[0] or "/"
    assert node.get_logger().name == full[1:].replace("/", ".")


BAD_TOPICS = [
    ("", "topic name must not be empty string:\n  ''\n   ^"),
    ("a b", "topic name must not contain characters other than alphanumerics, '_', '~', '{', "
            "or '}':\n  'a b'\n    ^"),
    ("1a", "topic name token must not start with a number:\n  '1a'\n   ^"),
    ("a/1b", "topic name token must not start with a number:\n  'a/1b'\n     ^"),
    ("a/", "topic name must not end with a forward slash:\n  'a/'\n    ^"),
    ("a//b", "topic name must not contain repeated '/':\n  '/ns/a//b'\n         ^"),
    ("a~", "topic name must not have tilde '~' unless it is the first character:\n  'a~'\n    ^"),
    ("~ab", "topic name must not have a tilde '~' that is not followed by a forward slash '/'"
            ":\n  '~ab'\n    ^"),
    ("a{b", "topic name must not have unmatched (unbalanced) curly braces '{}':\n  'a{b'\n    ^"),
    ("a}", "topic name must not have unmatched (unbalanced) curly braces '{}':\n  'a}'\n    ^"),
    ("{a/b}", "substitution name must not contain characters other than alphanumerics or '_'"),
    ("{1a}", "substitution name must not start with a number:\n  '{1a}'\n    ^"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text"), BAD_TOPICS)
def test_bad_topic_names(executor: SingleThreadedExecutor, name: str, text: str) -> None:
    """Publishers and subscriptions refuse them alike, services with an error of their own."""
    node = make(executor, namespace="ns")
    for create in (
        lambda: node.create_publisher(String, name, 1),
        lambda: node.create_subscription(String, name, print, 1),
    ):
        with pytest.raises(InvalidTopicNameException) as caught:
            create()
        assert str(caught.value).startswith("Invalid topic name: " + text)
    for create in (
        lambda: node.create_service(Trigger, name, print),
        lambda: node.create_client(Trigger, name),
    ):
        with pytest.raises(InvalidServiceNameException) as refused:
            create()
        assert str(refused.value).startswith("Invalid service name: " + text)
    with pytest.raises(RuntimeError):
        node.resolve_topic_name(name)


@pytest.mark.usefixtures("executor")
def test_names_are_expanded() -> None:
    """`~` and substitutions stand for the node's names; a name of its own stays relative."""
    node = Node("n", namespace="/a/b")
    for name, full in (
        ("x", "/a/b/x"), ("x/y", "/a/b/x/y"), ("/x", "/x"), ("~", "/a/b/n"), ("~/x", "/a/b/n/x"),
        ("{node}/x", "/a/b/n/x"), ("{ns}/x", "/a/b/x"), ("/c{namespace}", "/c/a/b"),
        ("a__b", "/a/b/a__b"), ("_hidden", "/a/b/_hidden"),
    ):  # fmt: skip
        assert node.resolve_topic_name(name) == full
        assert node.resolve_service_name(name, only_expand=True) == full
    publisher = node.create_publisher(String, "~/x", 1)
    assert (publisher.topic, publisher.topic_name) == ("~/x", "/a/b/n/x")
    with pytest.raises(ValueError, match=r"unknown substitution"):
        node.create_publisher(String, "{nobody}", 1)


def test_nodes_are_renamed(arguments: Any) -> None:
    """Rules without a node hold for all; a rule's node is the name that the program gave."""
    arguments("-r", "first:__node:=one", "-r", "one:__ns:=/deep/er", "-r", "second:__ns:=/two")
    first, second, third = Node("first"), Node("second"), Node("third", namespace="kept")
    assert first.get_fully_qualified_name() == "/deep/er/one"
    assert second.get_fully_qualified_name() == "/two/second"
    assert third.get_fully_qualified_name() == "/kept/third"
    alone = Node("first", use_global_arguments=False)
    assert alone.get_fully_qualified_name() == "/first"


def test_topics_and_services_are_remapped(arguments: Any) -> None:
    """The first rule that fits counts; both its sides are expanded in the node's namespace."""
    arguments(
        "-r", "in:=out", "-r", "in:=never", "-r", "/abs:=rel", "-r", "~/own:=/mine",
        "-r", "other:only:=wrong", "-r", "n:only:=right", "-r", "x:=~/y", "-r", "out:=chain",
        "-r", "rostopic://both:=topic", "-r", "rosservice://both:=service",
    )  # fmt: skip
    node = Node("n", namespace="/ns")
    for name, full in (
        ("in", "/ns/out"), ("/ns/in", "/ns/out"), ("/in", "/in"), ("/abs", "/ns/rel"),
        ("~/own", "/mine"), ("only", "/ns/right"), ("x", "/ns/n/y"), ("both", "/ns/topic"),
    ):  # fmt: skip
        assert node.resolve_topic_name(name) == full
    assert node.resolve_service_name("in") == "/ns/out"
    assert node.resolve_service_name("both") == "/ns/service"
    assert node.resolve_topic_name("in", only_expand=True) == "/ns/in"
    assert node.create_publisher(String, "in", 1).topic_name == "/ns/out"
    assert node.create_client(Trigger, "in").service_name == "/ns/out"


def test_arguments_of_one_node(arguments: Any) -> None:
    """A node's own arguments go before those of the process."""
    arguments("-r", "a:=of_all", "-r", "b:=of_all", "-p", "p:=1", "-p", "q:=1")
    node = Node("n", cli_args=["--ros-args", "-r", "a:=own", "-r", "__node:=m", "-p", "p:=2"])
    assert node.get_name() == "m"
    assert node.resolve_topic_name("a") == "/own"
    assert node.resolve_topic_name("b") == "/of_all"
    assert node.declare_parameter("p", 0).value == 2
    assert node.declare_parameter("q", 0).value == 1
    alone = Node("n", cli_args=["--ros-args", "-r", "a:=own"], use_global_arguments=False)
    assert alone.resolve_topic_name("b") == "/b"
    with pytest.raises(RuntimeError):
        Node("n", cli_args=["--ros-args", "--nonsense"])
    with pytest.raises(RuntimeError):
        Node("n", cli_args=["--ros-args", "-r", "nonsense"])


def test_remapped_endpoints_meet(arguments: Any) -> None:
    """What is remapped is what is on the wire."""
    arguments("-r", "a:talk:=/meet", "-r", "a:serve:=/ask")
    executor = SingleThreadedExecutor()
    one, two = make(executor, "a"), make(executor, "b")
    got: list[str] = []
    two.create_subscription(String, "/meet", lambda m: got.append(m.data), 1)
    publisher = one.create_publisher(String, "talk", 1)

    def serve(_: Any, response: Any) -> Any:
        response.message = "served"
        return response

    one.create_service(Trigger, "serve", serve)
    client = two.create_client(Trigger, "/ask")
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String(data="hello"))
    assert spin_until(executor, lambda: got == ["hello"])
    assert client.wait_for_service(20.0)
    assert result(executor, client.call_async(Trigger.Request())).message == "served"
    assert two.count_publishers("/meet") == 1
    assert two.count_publishers("/talk") == 0
    assert one.count_publishers("talk") == 0  # a name that is asked for is not remapped
    assert len(one.get_publishers_info_by_topic("talk")) == 1  # here it is


PLAUSIBLE = [
    "_keep", "_destroy", "_destroyed", "_entities", "_waitables", "_arguments", "_name",
    "_namespace", "_clock_subscription", "_follow_sim_time", "_on_clock", "_of_node", "_node",
    "_executor", "_graph", "_lock", "_state", "_callback", "_callbacks", "_timer", "_publisher",
    "_subscription", "_service", "_client", "_spin", "_run", "_stop", "_shutdown", "_ok", "_wake",
    "_queue", "_tasks", "_thread", "_on_timer", "_publish", "_log", "_rosout", "_events", "_store",
    "_overrides", "_handle", "_resolve", "_resolved", "_time", "_participant", "_entry",
    "entities", "entry", "timers_list", "state", "name", "namespace", "parameters", "arguments",
    "topics", "graph", "store", "clock", "logger", "qos", "callback", "timer", "publisher",
    "subscription", "client", "service", "services_list", "action_server", "data", "queue", "wake",
    "run", "stop", "start", "reset", "update", "destroy", "close", "poll", "turn", "put", "receive",
]  # fmt: skip


@pytest.mark.parametrize("as_method", [True, False])
def test_a_subclass_may_use_any_name(executor: SingleThreadedExecutor, as_method: bool) -> None:
    """Attributes and methods of a subclass that rclpy's Node has not do not break it."""

    def forbidden(*_: Any, **__: Any) -> None:
        raise AssertionError("a node called a method of its subclass")

    value: Any = forbidden if as_method else 5
    body = {name: value for name in PLAUSIBLE}
    kind: Any = type("Mine", (Node,), body)
    node = kind("mine", parameter_overrides=[rclpy.parameter.Parameter("use_sim_time", value=True)])
    if not as_method:
        for name in PLAUSIBLE:
            setattr(node, name, value)
    executor.add_node(node)
    got: list[Any] = []
    subscription = node.create_subscription(String, "x", got.append, 1)
    publisher = node.create_publisher(String, "x", 1)
    service = node.create_service(Trigger, "y", lambda _, response: response)
    client = node.create_client(Trigger, "y")
    timer = node.create_timer(0.001, lambda: None)
    node.declare_parameter("p", 1)
    node.set_parameters([rclpy.parameter.Parameter("use_sim_time", value=False)])
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String())
    assert spin_until(executor, lambda: got)
    assert client.wait_for_service(20.0)
    assert result(executor, client.call_async(Trigger.Request())) == Trigger.Response()
    node.get_logger().info("still there")
    assert spin_until(executor, lambda: node.get_publishers_info_by_topic("x"))
    assert node.destroy_timer(timer)
    assert node.destroy_client(client)
    assert node.destroy_service(service)
    assert node.destroy_publisher(publisher)
    assert node.destroy_subscription(subscription)
    executor.remove_node(node)
    node.destroy_node()
