"""Fixtures of the tests that cross packages: a domain of one's own, the demo, the graph."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from ament_index_python.packages import get_package_share_directory
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from reference_door import ReferenceDoor

GUARD = 180.0  # [s] of wall time after which something hangs; nothing is asserted on it
MARK = "HRP2_TEST_PROCESS"  # in the environment of every process that the tests start
NODES = ("closer_identifier", "door_encoder", "hrp2_sim_bridge", "impact_executor",
         "impact_planner", "zmp_publisher")


def _environments() -> Iterator[tuple[int, dict[str, str]]]:
    """Every process of this machine whose environment can be read."""
    for path in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            pairs = path.read_bytes().decode("utf-8", "replace").split("\0")
            yield int(path.parent.name), dict(p.split("=", 1) for p in pairs if "=" in p)


@pytest.fixture(scope="session", autouse=True)
def domain() -> Iterator[int]:
    """A random ROS_DOMAIN_ID that no other process here uses, for this session alone."""
    taken = {environment.get("ROS_DOMAIN_ID") for _, environment in _environments()}
    number = random.choice([n for n in range(1, 101) if str(n) not in taken])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(number))
        yield number
        if "ROS_DISTRO" in os.environ:  # its commands leave a daemon behind in this domain
            run_command(find_ros2(), "daemon", "stop")


def find_ros2() -> str:
    """The ros2 command beside this interpreter, or the one on the path."""
    beside = Path(sys.executable).parent / "ros2"
    found = str(beside) if beside.exists() else shutil.which("ros2")
    assert found, "no ros2 command: run `make setup`, or source ROS 2"
    return found


class Started:
    """A process with a session and a mark of its own; its output goes to a file."""

    def __init__(self, command: list[str], output: Path) -> None:
        self.mark = uuid.uuid4().hex
        self.output = output
        with output.open("wb") as file:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                env={**os.environ, MARK: self.mark, "PYTHONUNBUFFERED": "1"},
                start_new_session=True)

    def text(self) -> str:
        """What it and its children wrote so far."""
        return self.output.read_text(errors="replace")

    def wait_for_text(self, wanted: str) -> None:
        """Waits until a text was written."""
        end = time.monotonic() + GUARD
        while wanted not in self.text():
            assert self.process.poll() is None, self.text()
            assert time.monotonic() < end, f"{wanted!r} never came:\n{self.text()}"
            time.sleep(0.05)

    def family(self) -> list[int]:
        """Ids of the process and of all it started, whatever their parents are by now."""
        return [pid for pid, environment in _environments() if environment.get(MARK) == self.mark]

    def left_over(self) -> list[int]:
        """Those of them that do not end: orphans get time to notice that their launcher is gone."""
        end = time.monotonic() + 60.0
        while (left := self.family()) and time.monotonic() < end:
            time.sleep(0.1)
        return left

    def signal_group(self, number: signal.Signals) -> None:
        """Signals the process group, as a terminal does."""
        os.killpg(self.process.pid, number)

    def wait(self) -> int:
        """Exit status."""
        return self.process.wait(GUARD)

    def clean_up(self) -> None:
        """Ends by id whatever is left."""
        for _ in range(3):  # one may be starting another
            for pid in self.family():
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
        self.process.wait()


Start = Callable[..., Started]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts `ros2 ...` beside the test and ends it, with its children, after it."""
    processes: list[Started] = []

    def run(*arguments: str) -> Started:
        started = Started([find_ros2(), *arguments], tmp_path / f"process_{len(processes)}.txt")
        processes.append(started)
        return started

    yield run
    for process in processes:
        process.clean_up()


@dataclass(frozen=True)
class Done:
    """A command that has ended."""

    status: int
    out: str
    err: str


Ros2 = Callable[..., Done]


def run_command(*command: str) -> Done:
    """Runs a command to its end."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=GUARD,
                          stdin=subprocess.DEVNULL, check=False)
    return Done(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="session")
def ros2() -> Ros2:
    """Runs `ros2 ...` to its end."""
    return lambda *arguments: run_command(find_ros2(), *arguments)


@pytest.fixture(scope="session")
def python() -> Ros2:
    """Runs Python code, given as a text, to its end."""
    return lambda code, *arguments: run_command(sys.executable, "-c", code, *arguments)


# -- the demonstration ------------------------------------------------------------------------


@dataclass(frozen=True)
class Demo:
    """A run of the demonstration."""

    status: int
    text: str
    out: Path
    left_over: list[int]


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    """The demonstration, run once as a user would."""
    folder = tmp_path_factory.mktemp("demo")
    out = folder / "out"
    started = Started([find_ros2(), "run", "door_impact_bringup", "demo", "--out", str(out)],
                      folder / "printed.txt")
    try:
        status = started.process.wait(600.0)
        yield Demo(status, started.text(), out, started.family())
    finally:
        started.clean_up()


# -- the graph ----------------------------------------------------------------------------------


class Graph:
    """The running nodes, and a node of the tests among them."""

    def __init__(self, started: Started, beside: Sequence[Started] = ()) -> None:
        self.started, self.beside = started, beside
        self.node = Node("tests_of_the_graph")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)

    def spin_until(self, condition: Callable[[], Any], what: str) -> None:
        """Handles messages until a condition holds."""
        end = time.monotonic() + GUARD
        while not condition():
            for process in (self.started, *self.beside):
                assert process.process.poll() is None, process.text()
            assert time.monotonic() < end, f"{what} never came:\n{self.started.text()}"
            self._executor.spin_once(timeout_sec=0.1)

    def listen(self, kind: Any, topic: str, until: Callable[[list[Any]], Any], *,
               meanwhile: Callable[[], Any] = lambda: None, latched: bool = False) -> list[Any]:
        """Messages of a topic from now on, until they are enough.

        Args:
            kind: Type.
            topic: Name.
            until: Told the messages, says whether they are enough.
            meanwhile: Done after the first message.
            latched: Whether the topic keeps its last message.
        """
        heard: list[Any] = []
        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL) if latched \
            else QoSProfile(depth=2000)
        subscription = self.node.create_subscription(kind, topic, heard.append, qos)
        try:
            self.spin_until(lambda: heard, topic)
            meanwhile()
            self.spin_until(lambda: until(heard), f"enough of {topic}")
        finally:
            self.node.destroy_subscription(subscription)
        return heard

    def last(self, kind: Any, topic: str, *, latched: bool = False) -> Any:
        """One message of a topic."""
        return self.listen(kind, topic, len, latched=latched)[-1]

    def call(self, kind: Any, name: str, **fields: Any) -> Any:
        """The answer of a service."""
        client = self.node.create_client(kind, name)
        try:
            self.spin_until(client.service_is_ready, name)
            future = client.call_async(kind.Request(**fields))
            self.spin_until(future.done, f"the answer of {name}")
            return future.result()
        finally:
            self.node.destroy_client(client)

    def result(self, future: Any, what: str) -> Any:
        """Result of a future."""
        self.spin_until(future.done, what)
        return future.result()


@contextmanager
def launch(folder: Path, *arguments: str, beside: Sequence[list[str]] = ()) -> Iterator[Graph]:
    """The nodes of bringup.launch.yaml; Ctrl-C must end them all.

    Args:
        folder: For their output.
        arguments: Of the launch file.
        beside: Commands that run beside them, as a robot's driver does.
    """
    from geometry_msgs.msg import PointStamped

    others = [Started(command, folder / f"beside_{i}.txt") for i, command in enumerate(beside)]
    started = Started([find_ros2(), "launch", "door_impact_bringup", "bringup.launch.yaml",
                       *arguments], folder / "nodes.txt")
    rclpy.init(args=[])
    try:
        running = Graph(started, others)
        running.last(PointStamped, "/zmp")
        yield running
        for process in (started, *others):
            process.process.send_signal(signal.SIGINT)
            process.wait()
            assert process.family() == [], f"processes survived Ctrl-C:\n{process.text()}"
            assert "Traceback" not in process.text(), process.text()
            assert "failed to terminate" not in process.text()
    finally:
        for process in (started, *others):
            process.clean_up()
        rclpy.try_shutdown()


@pytest.fixture(scope="session")
def launch_nodes() -> Callable[..., AbstractContextManager[Graph]]:
    """`launch`, for tests that choose its arguments."""
    return launch


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Graph]:
    """Every node, as `make up` starts them but as fast as it goes."""
    with launch(tmp_path_factory.mktemp("graph"), "paced:=false") as running:
        yield running


# -- the true door -------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def paper_door() -> dict[str, Any]:
    """doors/paper.yaml as it stands in the package."""
    path = Path(get_package_share_directory("door_model")) / "doors" / "paper.yaml"
    return yaml.safe_load(path.read_text())


@pytest.fixture(scope="session")
def reference_door(paper_door: dict[str, Any]) -> Callable[..., ReferenceDoor]:
    """The paper door by the independent eq. (1), other parameters on request."""
    true = {"i_a": paper_door["i_a"], **paper_door["closer"]}
    return lambda **other: ReferenceDoor(**{**true, **other}, linkage=paper_door["linkage"])
