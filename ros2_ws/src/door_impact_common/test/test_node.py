"""How a node starts and ends."""

import os
import signal
import time

import pytest
import rclpy
from door_impact_common.errors import DoorImpactError, SettingError
from door_impact_common.node import TwinError, refuse_twin, run_node
from rclpy.node import Node
from rclpy.signals import uninstall_signal_handlers


@pytest.fixture(autouse=True)
def handlers():
    """A process calls run_node once, and rclpy's signal handlers stay; here it is called again."""
    before = signal.getsignal(signal.SIGINT)
    yield
    uninstall_signal_handlers()
    signal.signal(signal.SIGINT, before)


class Lonely(Node):
    """A node that does nothing."""

    def __init__(self):
        super().__init__("tested")


def failing(error):
    """A function that makes no node, but raises an error."""

    def make():
        raise error

    return make


@pytest.mark.parametrize("error", [SettingError("width", -1.0, "positive"), OSError("no file")])
def test_a_node_that_cannot_start_says_why_in_one_line(error, capfd):
    """Errors of the project, and those that are listed, end with code 1 and no traceback."""
    assert run_node(failing(error), errors=(OSError,), args=[]) == 1
    assert capfd.readouterr().err.splitlines()[-1] == f"make: {error}"
    assert not rclpy.ok()


def test_other_errors_are_faults_of_the_program_and_pass():
    """A traceback helps whoever mends the program; rclpy is shut down all the same."""
    with pytest.raises(ZeroDivisionError):
        run_node(failing(ZeroDivisionError()), args=[])
    assert not rclpy.ok()


def test_an_error_while_the_node_runs_carries_its_name(capfd):
    """The node's own name stands before the message."""

    def spin(node):
        raise DoorImpactError("the door is gone")

    assert run_node(Lonely, args=[], spin=spin) == 1
    assert capfd.readouterr().err.splitlines()[-1] == "tested: the door is gone"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_node_with_code_0(number):
    """Ctrl-C and SIGTERM are the usual end of a node."""

    def spin(node):
        def strike():
            timer.cancel()  # a second signal would meet pytest itself
            os.kill(os.getpid(), number)

        timer = node.create_timer(0.1, strike)
        rclpy.spin(node)

    assert run_node(Lonely, args=[], spin=spin) == 0
    assert not rclpy.ok()


def test_two_nodes_of_one_name_are_refused():
    """Both would answer requests and send commands."""
    rclpy.init()
    nodes = [Lonely(), Lonely()]
    try:
        with pytest.raises(TwinError, match=r"another node named /tested .* ROS_") as found:
            refuse_twin(nodes[0], time.monotonic() + 30.0)
        assert found.value.value == "/tested"
        nodes.pop().destroy_node()
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.shutdown()


def test_a_node_alone_is_not_refused():
    """The wait ends at the given time."""
    rclpy.init()
    node = Lonely()
    try:
        until = time.monotonic() + 0.2
        refuse_twin(node, until)
        assert time.monotonic() >= until
    finally:
        node.destroy_node()
        rclpy.shutdown()
