"""What a full disk does to the simulation's log, and to a graph that is being recorded.

No file of a process may exceed a limit here, which looks like a full disk to the process.
"""

import random
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import rclpy
from door_model.recording.mcap import open_bag
from processes import GUARD, find_ros2, parameters
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger


def limited(blocks: int, *arguments: str) -> list[str]:
    """The command `ros2 ...` whose files have at most so many blocks of 512 bytes."""
    return ["sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh", find_ros2(), *arguments]


@pytest.fixture
def caller() -> Any:
    """Calls a service without a request, and returns its answer."""
    rclpy.init(args=[])
    node = Node("caller")

    def call(name: str) -> Any:
        client = node.create_client(Trigger, name)
        assert client.wait_for_service(60.0)
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=60.0)
        return future.result()

    yield call
    node.destroy_node()
    rclpy.try_shutdown()


def test_the_simulation_goes_on_without_its_log(
        start_process: Callable[..., Any], caller: Callable[[str], Any], tmp_path: Path) -> None:
    """~/save_log answers so, and at the end the node says so; the older log is left as it was."""
    path = tmp_path / "out" / "simulation.npz"
    path.parent.mkdir()
    path.write_text("older")
    started = start_process(limited(
        500, "run", "hrp2_sim_bridge", "hrp2_sim_bridge", "--ros-args", "--params-file",
        parameters(), "-p", f"log_file:={path}"))
    answer, end = caller("/hrp2_sim_bridge/save_log"), time.monotonic() + GUARD
    while answer.success:  # the log is still small
        path.write_text("older")
        assert time.monotonic() < end
        answer = caller("/hrp2_sim_bridge/save_log")
    sentence = f"{path} cannot be written: File too large"
    assert answer.message == sentence
    assert [found.read_text() for found in path.parent.iterdir()] == ["older"]
    started.signal_group(signal.SIGINT)
    assert started.wait() == 0
    assert started.text().count(f"hrp2_sim_bridge: {sentence}") == 1
    assert "Traceback" not in started.text()
    assert "Exception" not in started.text()
    assert [found.read_text() for found in path.parent.iterdir()] == ["older"]


def test_the_recording_keeps_what_fits(
        start_process: Callable[..., Any], caller: Callable[[str], Any], tmp_path: Path) -> None:
    """The recorder ends with a sentence; the first messages can be read, in order."""
    path = tmp_path / "run.mcap"
    started = start_process(limited(
        500, "run", "door_impact_bringup", "recorder", "--ros-args", "-p", f"file:={path}"))
    node = Node("talker")
    texts, noise = node.create_publisher(String, "/text", 1000), random.Random(0)
    number, end = 0, time.monotonic() + GUARD
    while started.process.poll() is None:
        assert time.monotonic() < end, started.text()
        texts.publish(String(data=f"{number} {noise.randbytes(500).hex()}"))
        number += 1
        time.sleep(0.005)
    node.destroy_node()
    assert started.wait() == 1
    assert started.text().count(f"recorder: {path}: cannot be written: File too large") == 1
    assert "Traceback" not in started.text()
    with open_bag(path) as bag:
        chosen = [each for each in bag.connections if each.topic == "/text"]
        got = [int(bag.deserialize(data, each.msgtype).data.split()[0])
               for each, _, data in bag.messages(chosen)]
    assert len(got) > 100
    assert got == list(range(got[0], got[0] + len(got)))
