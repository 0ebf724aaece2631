"""What the tests of nodes share: nodes on an executor, and waiting, by spinning or for an end."""

import subprocess
import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node


def make(executor: Any, name: str = "tester", **options: Any) -> Node:
    """A node that the executor spins."""
    node = Node(name, **options)
    executor.add_node(node)
    return node


def spin_until(executor: Any, done: Callable[[], Any], limit: float = 20.0) -> bool:
    """Spins until `done`, in steps of 20 ms at most; whether it came to that in time [s]."""
    deadline = time.monotonic() + limit
    while not done() and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.02)
    return bool(done())


def result(executor: Any, future: Any) -> Any:
    """Spins until the future is done."""
    executor.spin_until_future_complete(future, timeout_sec=20.0)
    assert future.done()
    return future.result()


def ended(process: "subprocess.Popen[str]") -> tuple[int, str]:
    """Exit code and output of a process."""
    out, _ = process.communicate(timeout=60)
    return process.returncode, out
