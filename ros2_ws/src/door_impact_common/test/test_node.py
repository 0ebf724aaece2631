"""How a node starts and ends."""

import signal
import subprocess
import sys
import time

import pytest
import rclpy
from door_impact_common.errors import SettingError
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
    """A function that raises an error."""

    def make(*_):
        raise error

    return make


def test_a_node_that_cannot_start_says_why_in_one_line(capfd):
    error = SettingError("width", -1.0, "positive")
    for make, spin, name in ((failing(error), None, "make"), (Lonely, failing(error), "tested")):
        assert run_node(make, args=[], **({"spin": spin} if spin else {})) == 1
        assert capfd.readouterr().err.splitlines()[-1] == f"{name}: {error}"
        assert not rclpy.ok()


def test_other_errors_are_faults_of_the_program_and_pass():
    """A traceback helps whoever mends the program; rclpy is shut down all the same."""
    with pytest.raises(ZeroDivisionError):
        run_node(failing(ZeroDivisionError()), args=[])
    assert not rclpy.ok()


ENDLESS = """
import sys
from door_impact_common.node import run_node, spin
from rclpy.node import Node

def run(node):
    node.create_timer(0.1, lambda: print("spinning", flush=True))
    spin(node)

sys.exit(run_node(lambda: Node("tested"), args=[], spin=run))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_node_with_code_0(number):
    """Ctrl-C and SIGTERM are the usual end of a node."""
    with subprocess.Popen([sys.executable, "-c", ENDLESS], stdout=subprocess.PIPE) as node:
        assert node.stdout.readline() == b"spinning\n"
        node.send_signal(number)
    assert node.returncode == 0


def test_two_nodes_of_one_name_are_refused():
    """Both would answer requests and send commands."""
    rclpy.init()
    nodes = [Lonely(), Lonely()]
    try:
        with pytest.raises(TwinError, match="/tested") as found:
            refuse_twin(nodes[0], time.monotonic() + 30.0)
        assert found.value.value == "/tested"
        nodes.pop().destroy_node()
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.shutdown()
