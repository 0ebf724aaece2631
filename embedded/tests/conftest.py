"""Processes and executors for the tests of the runtime."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

HERE = Path(__file__).parent


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


@pytest.fixture
def ros2() -> Callable[..., "subprocess.CompletedProcess[str]"]:
    """Runs the `ros2` command, the one beside this Python or else the one on PATH, to its end."""
    here = Path(sys.executable).with_name("ros2")
    command = str(here) if here.exists() else "ros2"

    def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run([command, *arguments], capture_output=True, text=True, timeout=30)

    return run
