"""Handlers of signals that raise or shut down, wherever they come."""

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from cyclonedds._clayer import ddspy_take
from rclpy.executors import SingleThreadedExecutor
from ros2_embedded.samples import samples_of
from spinning import ended, make, spin_until
from std_msgs.msg import String

Start = Callable[..., "subprocess.Popen[str]"]

BEGIN = """
import multiprocessing, os, random, signal, sys, threading, time
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool
"""
"""What every program below begins with."""


def test_samples_are_taken_without_a_step_of_python(executor: SingleThreadedExecutor) -> None:
    """A signal is handled before or after: an exception within would crash Cyclone DDS's C."""
    node = make(executor)
    publisher = node.create_publisher(String, "x", 1)
    reader = node.create_subscription(String, "x", print, 1)._reader
    executor.remove_node(node)
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String(data="x"))
    called: list[str] = []

    def note(frame: Any, event: str, _: Any) -> None:
        if event == "call":
            called.append(frame.f_code.co_qualname)

    condition, _ = samples_of(reader, print)
    sys.setprofile(note)
    taken = ddspy_take(reader._ref, condition.mask, 1)
    sys.setprofile(None)
    assert called == []
    data, info = taken[0]
    assert (data[4:10], info.valid_data) == (b"\2\0\0\0x\0", True)
    assert info.source_timestamp > 0
    assert info.publication_handle == publisher._writer.get_instance_handle() % (1 << 64)


def test_exceptions_of_handlers_come_out_of_spin(start: Start) -> None:
    """Hundreds while messages come: each, and nothing crashes."""
    program = f"""{BEGIN}
class Late(Exception):
    pass

def late(*_):
    raise Late

rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
node, over = Node("tester"), threading.Event()
publisher = node.create_publisher(JointState, "x", 1000)
node.create_subscription(JointState, "x", lambda _: None, 1000)
message = JointState(name=[str(i) for i in range(30)])

def publish():
    while not over.wait(0.0005):
        publisher.publish(message)

thread = threading.Thread(target=publish)
thread.start()
signal.signal(signal.SIGALRM, late)
for _ in range(500):
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    signal.setitimer(signal.ITIMER_REAL, random.uniform(0.001, 0.003))
    try:
        executor.spin()
    except Late:
        continue
    finally:
        executor.shutdown()
over.set()
thread.join()
rclpy.shutdown()
print("ended")
"""
    assert ended(start("-c", program)) == (0, "ended\n")


@pytest.mark.parametrize(
    "work",
    [
        "node.get_topic_names_and_types()",
        "node.destroy_subscription(node.create_subscription(String, 'x', print, 1))",
        "node.destroy_publisher(node.create_publisher(String, 'x', 1))",
        "client.service_is_ready()",
        "rclpy.spin_once(node, timeout_sec=0.01)",
    ],
)
def test_a_handler_may_shut_down(start: Start, work: str) -> None:
    """Whatever it interrupts, the process ends."""
    program = f"""{BEGIN}
rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
node = Node("tester_" + str(os.getpid()))
client = node.create_client(SetBool, "flip")
signal.signal(signal.SIGINT, lambda *_: rclpy.try_shutdown())
threading.Timer(random.uniform(0.1, 0.3), os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    while rclpy.ok():
        {work}
except Exception:
    assert not rclpy.ok()
print("ended")
"""
    for process in [start("-c", program) for _ in range(4)]:
        assert ended(process) == (0, "ended\n")


def test_ctrl_c_is_one_wherever_it_comes(start: Start) -> None:
    """Also while a thread asks DDS for endpoints, which makes other exceptions of it."""
    program = f"""{BEGIN}
rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
node = Node("tester")
node.create_service(SetBool, "flip", lambda _, response: response)
client = node.create_client(SetBool, "flip")
client.wait_for_service()
for _ in range(50):
    alarm = threading.Timer(random.uniform(0.001, 0.01), os.kill, (os.getpid(), signal.SIGINT))
    try:
        alarm.start()
        while True:
            client.service_is_ready()
    except KeyboardInterrupt:
        pass
print("ended")
"""
    assert ended(start("-c", program)) == (0, "ended\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_forked_child_hears_of_signals(start: Start, number: signal.Signals) -> None:
    """After the parent has spun and shut down."""
    program = f"""{BEGIN}
def child():
    rclpy.init(args=[])
    node = Node("child")
    node.create_timer(0.01, ready.set)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException) as error:
        print(type(error).__name__, flush=True)
    rclpy.try_shutdown()

rclpy.init(args=[])
rclpy.spin_once(Node("parent"), timeout_sec=0.1)
rclpy.shutdown()
context = multiprocessing.get_context("fork")
ready = context.Event()
process = context.Process(target=child)
process.start()
assert ready.wait(20.0)
time.sleep(0.1)
os.kill(process.pid, {int(number)})
process.join(20.0)
assert not process.is_alive()
"""
    word = "KeyboardInterrupt" if number == signal.SIGINT else "ExternalShutdownException"
    assert ended(start("-c", program)) == (0, f"{word}\n")


def test_an_executable_that_is_interrupted_while_it_loads_ends_in_one_line(
    start: Start, tmp_path: Path
) -> None:
    """A launch that ends early interrupts its nodes there; the signal ends them, as before."""
    (tmp_path / "slow_to_load.py").write_text(
        "import time\nprint('loading', flush=True)\ntry:\n    time.sleep(60)\n"
        "except KeyboardInterrupt as error:\n    raise ImportError('half done') from error\n"
    )
    program = f"""
import sys
from importlib.metadata import EntryPoint
from ros2_embedded.executable import run
sys.path.insert(0, {str(tmp_path)!r})
run("slow", EntryPoint("slow", "slow_to_load:main", "console_scripts"), [])
"""
    process = start("-c", program)
    assert process.stdout is not None
    assert "loading" in process.stdout.readline()
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT
    assert out.splitlines() == ["slow: interrupted before it began"]
