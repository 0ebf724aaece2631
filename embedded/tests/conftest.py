"""Processes and executors for the tests of the runtime."""

import gc
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

_LOGS = tempfile.TemporaryDirectory(prefix="ros_logs_")
os.environ["ROS_LOG_DIR"] = _LOGS.name

HERE = Path(__file__).parent
Start = Callable[..., subprocess.Popen[str]]
Done = subprocess.CompletedProcess[str]


@pytest.fixture
def executor() -> Iterator[SingleThreadedExecutor]:
    """An executor in a fresh context; its nodes are gone after the test."""
    rclpy.init(args=[])
    executor = SingleThreadedExecutor()
    try:
        yield executor
    finally:
        # ROS 2's stay in the graph after a shutdown, as long as anything refers to them.
        for node in executor.get_nodes():
            node.destroy_node()
        rclpy.try_shutdown()


@contextmanager
def starter(*program: str) -> Iterator[Start]:
    """Starts a program with arguments, several times; what has been started ends in the end."""
    processes: list[subprocess.Popen[str]] = []

    def run(*arguments: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [*program, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        processes.append(process)
        return process

    yield run
    for process in processes:
        process.terminate()  # a node that is killed stays in the graph for its lease
    for process in processes:
        try:
            process.communicate(timeout=5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts Python programs, and ends them after the test."""
    with starter(sys.executable, "-u") as run:
        yield run


def start_peer(start: Start) -> subprocess.Popen[str]:
    """Starts the node of `peer_node.py`, and waits until it spins."""
    gc.collect()  # ROS 2's nodes of earlier tests stay in the graph until then
    process = start(str(HERE / "peer_node.py"))
    assert process.stdout is not None
    assert "ready" in process.stdout.readline()
    return process


@pytest.fixture
def peer(start: Start) -> subprocess.Popen[str]:
    """The node of `peer_node.py`, in a process of its own."""
    return start_peer(start)


@pytest.fixture(scope="module")
def shared_peer() -> Iterator[subprocess.Popen[str]]:
    """The same, one for all tests of a module that leave it as it is."""
    with starter(sys.executable, "-u") as run:
        yield start_peer(run)


def find_ros2() -> str:
    """The `ros2` command: the one beside this Python, or else the one on PATH."""
    here = Path(sys.executable).with_name("ros2")
    return str(here) if here.exists() else "ros2"


@pytest.fixture
def start_ros2() -> Iterator[Start]:
    """Starts the `ros2` command, and ends it after the test."""
    with starter(find_ros2()) as run:
        yield run


@pytest.fixture
def ros2() -> Callable[..., Done]:
    """Runs the `ros2` command to its end."""

    def run(*arguments: str) -> Done:
        command = [find_ros2(), *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=120)

    return run


@pytest.fixture
def ros2_each(ros2: Callable[..., Done]) -> Callable[..., list[Done]]:
    """Runs several `ros2` commands, given as texts, at once: each waits for discovery."""

    def run(*commands: str) -> list[Done]:
        with ThreadPoolExecutor() as pool:
            return list(pool.map(lambda command: ros2(*shlex.split(command)), commands))

    return run
