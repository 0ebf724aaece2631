"""After an exception in a callback a node logs it and goes on."""

import time

import pytest
import rclpy
from door_impact_common.node import GuardedNode
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import Trigger


class Fragile(GuardedNode):
    """A node whose callbacks all fail when they are told to."""

    def __init__(self):
        super().__init__("fragile")
        self.fails, self.received = True, []
        self.declare_parameter("gain", 1.0)
        self.create_subscription(String, "/text", self.on_text, 10)
        self.create_service(Trigger, "/act", self.on_act)
        self.create_timer(0.01, self.on_timer)
        self.add_on_set_parameters_callback(self.on_parameters)
        self.ticks = 0

    def on_text(self, message):
        self.received.append(message.data)
        self.work()

    def on_act(self, request, response):
        response.success, response.message = True, "done"
        self.work()
        return response

    def on_timer(self):
        self.ticks += 1
        self.work()

    def on_parameters(self, parameters):
        self.work()
        return SetParametersResult(successful=True)

    def work(self):
        if self.fails:
            raise RecursionError("secret")


@pytest.fixture
def rig():
    """The node and another one, and a function that spins both until a condition holds."""
    rclpy.init()
    node, other = Fragile(), rclpy.create_node("other")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.add_node(other)

    def until(done):
        limit = time.monotonic() + 30.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            executor.spin_once(timeout_sec=0.05)

    yield node, other, until
    executor.shutdown()
    node.destroy_node()
    other.destroy_node()
    rclpy.shutdown()


def test_a_service_that_fails_answers_so_and_works_later(rig):
    """The answer names the kind of the exception; nothing of a half-made answer is in it."""
    node, other, until = rig
    client = other.create_client(Trigger, "/act")
    until(client.service_is_ready)

    def answer():
        future = client.call_async(Trigger.Request())
        until(future.done)
        return future.result()

    failed = answer()
    assert not failed.success
    assert failed.message == "the service /act failed, a fault of the program: RecursionError"
    node.fails = False
    assert answer().message == "done"
    assert node.failures[failed.message] == 1


def test_subscriptions_and_timers_go_on_and_the_traceback_is_logged_once_for_each(rig, capfd):
    """Each message and each beat is tried; a callback at 200 Hz does not flood the log."""
    node, other, until = rig
    publisher = other.create_publisher(String, "/text", 10)

    def received():
        publisher.publish(String(data="a"))
        return len(node.received) >= 3 and node.ticks >= 3

    until(received)
    reason = "failed, a fault of the program: RecursionError"
    assert node.failures[f"the subscription of /text {reason}"] == len(node.received)
    assert node.failures[f"a timer {reason}"] == node.ticks
    text = "".join(capfd.readouterr())
    assert text.count("Traceback") == 2
    assert "[ERROR]" in text
    assert 'RecursionError("secret")' in text


def test_parameters_whose_check_fails_are_refused(rig):
    """They stay as they are, and can be set later."""
    node = rig[0]
    result = node.set_parameters([Parameter("gain", value=2.0)])[0]
    assert not result.successful
    assert "RecursionError" in result.reason
    assert node.get_parameter("gain").value == 1.0
    node.fails = False
    assert node.set_parameters([Parameter("gain", value=2.0)])[0].successful


def test_after_the_end_of_the_context_nothing_is_logged(rig):
    """A signal ends the context in the midst of a callback, in which publishing then fails."""
    node = rig[0]
    rclpy.shutdown()
    assert node.guarded(lambda: 1 // 0, "work")() is None
    assert not node.failures
    rclpy.init()
