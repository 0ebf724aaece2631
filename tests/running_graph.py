"""The nodes that run, and a node of the tests among them."""

import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import PointStamped
from processes import GUARD, Started, find_ros2
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage


def seconds(stamp: Any) -> float:
    """A stamp in seconds."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


class Graph:
    """The running nodes, and a node of the tests among them.

    Args:
        processes: Processes that must not end meanwhile.
        context: Context of the node; by default that of the process.
    """

    def __init__(self, *processes: Started, context: Context | None = None) -> None:
        self.processes = processes
        self.node = Node("tests_of_the_graph", context=context)
        self._clients: dict[str, Any] = {}
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)

    def spin_until(self, condition: Callable[[], Any], what: str) -> None:
        """Handles messages until a condition holds."""
        end = time.monotonic() + GUARD
        while not condition():
            for process in self.processes:
                assert process.process.poll() is None, process.text()
            assert time.monotonic() < end, "\n".join(
                [f"{what} never came:", *(process.text() for process in self.processes)])
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

    def client(self, kind: Any, name: str) -> Any:
        """The client of a service, which is there."""
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, name)
        self.spin_until(self._clients[name].service_is_ready, name)
        return self._clients[name]

    def call(self, kind: Any, name: str, **fields: Any) -> Any:
        """The answer of a service."""
        future = self.client(kind, name).call_async(kind.Request(**fields))
        return self.result(future, f"the answer of {name}")

    def reset(self) -> None:
        """Reset the simulation, and wait until the odometry begins anew."""
        stamps: list[float] = []

        def note(message: TFMessage) -> None:
            if message.transforms[0].child_frame_id == "base_link":
                stamps.append(seconds(message.transforms[0].header.stamp))

        heard = self.node.create_subscription(TFMessage, "/tf", note, 2000)
        self.spin_until(lambda: stamps and stamps[-1] > 1.0, "odometry")
        answer = self.call(Trigger, "/sim/reset")
        assert answer.success, answer.message
        self.spin_until(lambda: any(b < a for a, b in pairwise(stamps)), "odometry after a reset")
        self.node.destroy_subscription(heard)

    @contextmanager
    def frozen(self, node: str) -> Iterator[None]:
        """The processes of a node stand still meanwhile."""
        ids = [pid for process in self.processes for pid in process.family()
               if node.encode() in Path(f"/proc/{pid}/cmdline").read_bytes()]
        assert ids, node
        for pid in ids:
            os.kill(pid, signal.SIGSTOP)
        try:
            yield
        finally:
            for pid in ids:
                os.kill(pid, signal.SIGCONT)

    def result(self, future: Any, what: str = "an answer") -> Any:
        """Result of a future."""
        self.spin_until(future.done, what)
        return future.result()


@contextmanager
def graph_of(*processes: Started) -> Iterator[Graph]:
    """A node of the tests among running nodes."""
    context = Context()  # of its own: other tests of the process begin and end the default one
    rclpy.init(args=[], context=context)
    try:
        yield Graph(*processes, context=context)
    finally:
        rclpy.try_shutdown(context=context)


@contextmanager
def launch(folder: Path, *arguments: str, beside: Sequence[list[str]] = ()) -> Iterator[Graph]:
    """The nodes of bringup.launch.yaml; Ctrl-C must end them all.

    Args:
        folder: For their output.
        arguments: Of the launch file.
        beside: Commands that run beside them, as a robot's driver does.
    """
    others = [Started(command, folder / f"beside_{i}.txt") for i, command in enumerate(beside)]
    started = Started([find_ros2(), "launch", "door_impact_bringup", "bringup.launch.yaml",
                       *arguments], folder / "nodes.txt")
    try:
        with graph_of(started, *others) as running:
            running.last(PointStamped, "/zmp")
            yield running
        for process in (started, *others):
            process.process.send_signal(signal.SIGINT)
            process.wait()
            assert process.left_over() == [], f"processes survived Ctrl-C:\n{process.text()}"
            assert "Traceback" not in process.text(), process.text()
    finally:
        for process in (started, *others):
            process.clean_up()
