"""What several threads may do at once.

Not a part of the conformance tests: ROS 2 may lose the answer to a client that has just come, and
a shutdown may come out of a thread that spins as an error.
"""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest
import rclpy
from rclpy.client import Client
from rclpy.exceptions import NotInitializedException, RCLError
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.wait_for_message import wait_for_message
from spinning import make
from std_msgs.msg import String
from std_srvs.srv import SetBool

THREADS, CALLS = 4, 15

pytestmark = pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")


def flip(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
    response.success = not request.data
    return response


def test_clients_come_and_go_in_several_threads(executor: SingleThreadedExecutor) -> None:
    """Each call of a new client in a node of its own is answered, and the server lives on."""
    make(executor, "server").create_service(SetBool, "flip", flip)
    answers: list[bool] = []

    def visit(number: int) -> None:
        own = SingleThreadedExecutor()
        node = Node(f"visitor_{number}")
        own.add_node(node)
        for _ in range(CALLS):
            client = node.create_client(SetBool, "flip")
            assert client.wait_for_service(20.0)
            future: Any = client.call_async(SetBool.Request(data=False))
            own.spin_until_future_complete(future, timeout_sec=20.0)
            answers.append(future.result().success)
            node.destroy_client(client)

    visitors = [threading.Thread(target=visit, args=(i,), daemon=True) for i in range(THREADS)]
    for visitor in visitors:
        visitor.start()
    while any(visitor.is_alive() for visitor in visitors):
        executor.spin_once(timeout_sec=0.02)
    assert answers == [True] * (THREADS * CALLS)


@pytest.fixture
def switching_always() -> Iterator[None]:
    """Has Python's threads take turns after 10 microseconds."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(usual)


def test_threads_ask_for_servers_at_the_same_time(
    executor: SingleThreadedExecutor, switching_always: None
) -> None:
    """Each is told that there is one: what DDS knows of it is read in turns."""
    node = make(executor, "server")
    answers: list[bool] = []

    def ask(client: Client) -> None:
        answers.extend(client.service_is_ready() for _ in range(CALLS))

    clients = []
    for i in range(2 * THREADS):
        node.create_service(SetBool, f"flip_{i}", flip)
        clients.append(node.create_client(SetBool, f"flip_{i}"))
    threads = [threading.Thread(target=ask, args=(client,)) for client in clients]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [True] * (len(clients) * CALLS)


def test_a_shutdown_waits_for_what_is_being_made() -> None:
    """A thread that makes nodes and publishers all the time is told that the context is invalid."""
    for _ in range(10):
        rclpy.init(args=[])
        node, errors = Node("maker"), []

        def make_on(node: Node = node, errors: list[Exception] = errors) -> None:
            try:
                while True:
                    node.create_publisher(String, "x", 1)
                    Node("made").create_client(SetBool, "y")
            except (RCLError, NotInitializedException) as error:
                errors.append(error)

        thread = threading.Thread(target=make_on)
        thread.start()
        time.sleep(0.1)
        rclpy.shutdown()
        thread.join(20.0)
        assert len(errors) == 1


def test_a_shutdown_ends_a_thread_that_spins(capfd: pytest.CaptureFixture[str]) -> None:
    """At whichever point it is, and nothing is said."""
    for i in range(20):
        rclpy.init(args=[])
        node = Node("spinner")
        publisher = node.create_publisher(String, "x", 10)
        node.create_subscription(String, "x", lambda _: None, 10)
        node.create_timer(0.001, lambda publisher=publisher: publisher.publish(String()))
        thread = threading.Thread(target=rclpy.spin, args=(node,))
        thread.start()
        time.sleep(0.002 * i)
        rclpy.shutdown()
        thread.join(20.0)
        assert not thread.is_alive()
    assert capfd.readouterr().err == ""


def test_messages_are_waited_for_beside_a_thread_that_spins(
    executor: SingleThreadedExecutor,
) -> None:
    """Whichever takes a message first, it comes; a shutdown by the other ends the wait."""
    node = make(executor)
    publisher = node.create_publisher(String, "x", 1)
    timer = node.create_timer(0.001, lambda: publisher.publish(String(data="x")))

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    for _ in range(50):
        came, message = wait_for_message(String, node, "x", time_to_wait=20)
        assert (came, message) == (True, String(data="x"))
    timer.cancel()
    threading.Timer(0.1, rclpy.try_shutdown).start()
    assert wait_for_message(String, node, "none") == (False, None)
    thread.join(20.0)
    assert not thread.is_alive()
