"""Commands as processes, and a demo node that they talk to."""

import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

# pytest names these files after the outer folder, whose name hides the package's.
sys.modules.pop("ros2_commands", None)

ROS2 = [sys.executable, "-m", "ros2_commands.main"]
GUARD = 120.0  # [s] after which something hangs; nothing is asserted on it
Done = subprocess.CompletedProcess[str]


@pytest.fixture(scope="session")
def ros2() -> Callable[..., Done]:
    """Runs a command to its end."""
    return run_ros2


def run_ros2(*words: str) -> Done:
    return subprocess.run([*ROS2, *words], capture_output=True, text=True, timeout=GUARD,
                          stdin=subprocess.DEVNULL, check=False)  # fmt: skip


@pytest.fixture(scope="session")
def ros2_each() -> Callable[..., list[Done]]:
    """Runs several commands, given as texts, at once: each waits for discovery."""

    def run(*commands: str) -> list[Done]:
        with ThreadPoolExecutor(16) as pool:
            return list(pool.map(lambda command: run_ros2(*shlex.split(command)), commands))

    return run


@pytest.fixture
def start() -> Iterator[Callable[..., "subprocess.Popen[str]"]]:
    """Starts programs, whose stdout can be read, and ends them after the test."""
    started = []

    def run(*words: str) -> "subprocess.Popen[str]":
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True)  # fmt: skip
        started.append(process)
        return process

    yield run
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def demo() -> Iterator["subprocess.Popen[str]"]:
    """The node of `demo_node.py`."""
    command = [sys.executable, "-u", str(Path(__file__).with_name("demo_node.py"))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield process
        process.terminate()
