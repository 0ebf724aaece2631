"""A domain of its own for each test session, so that parallel runs do not meet."""

import os
import random
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor


def free_domain() -> int:
    """A domain whose first participant's port nobody has (RTPS: 7410 + 250 times the domain)."""
    while True:
        domain = random.randint(1, 100)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", 7410 + 250 * domain))
            except OSError:
                continue
        return domain


os.environ["ROS_DOMAIN_ID"] = str(free_domain())
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"

HERE = Path(__file__).parent


@pytest.fixture
def executor() -> Iterator[SingleThreadedExecutor]:
    """An executor in a fresh context."""
    rclpy.init(args=[])
    try:
        yield SingleThreadedExecutor()
    finally:
        rclpy.try_shutdown()


@pytest.fixture
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts Python programs, and ends them after the test."""
    processes: list[subprocess.Popen[str]] = []

    def run(*command: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-u", *command],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        processes.append(process)
        return process

    yield run
    for process in processes:
        process.kill()
        process.communicate()


@pytest.fixture
def peer(start: Callable[..., subprocess.Popen[str]]) -> subprocess.Popen[str]:
    """The node of `peer_node.py`, in a process of its own."""
    process = start(str(HERE / "peer_node.py"))
    assert process.stdout is not None
    assert "ready" in process.stdout.readline()
    return process


def find_ros2() -> str:
    """The `ros2` command: the one beside this Python, or else the one on PATH."""
    here = Path(sys.executable).with_name("ros2")
    return str(here) if here.exists() else "ros2"


@pytest.fixture
def start_ros2() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts the `ros2` command, and ends it after the test."""
    processes: list[subprocess.Popen[str]] = []

    def run(*arguments: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [find_ros2(), *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        processes.append(process)
        return process

    yield run
    for process in processes:
        process.kill()
        process.communicate()


@pytest.fixture
def ros2() -> Callable[..., "subprocess.CompletedProcess[str]"]:
    """Runs the `ros2` command to its end."""

    def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
        command = [find_ros2(), *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=30)

    return run
