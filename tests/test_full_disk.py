"""What a full disk does to the simulation's log, and to a graph that is being recorded.

No file of a process may exceed a limit here, which looks like a full disk to the process.
"""

import random
import signal
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

from door_model.recording.mcap import open_bag
from processes import find_ros2, parameters
from running_graph import graph_of
from std_msgs.msg import String
from std_srvs.srv import Trigger


def limited(blocks: int, *arguments: str) -> list[str]:
    """The command `ros2 ...` whose files have at most so many blocks of 512 bytes."""
    return ["sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh", find_ros2(), *arguments]


def test_the_simulation_goes_on_without_its_log(
        start_process: Callable[..., Any], tmp_path: Path) -> None:
    """~/save_log answers so, and at the end the node says so; the older log is left as it was."""
    path = tmp_path / "out" / "simulation.npz"
    path.parent.mkdir()
    started = start_process(limited(
        500, "run", "hrp2_sim_bridge", "hrp2_sim_bridge", "--ros-args", "--params-file",
        parameters(), "-p", f"log_file:={path}"))
    answers: list[Any] = []
    with graph_of(started) as graph:
        def too_large() -> bool:
            path.write_text("older")
            answers.append(graph.call(Trigger, "/hrp2_sim_bridge/save_log"))
            return not answers[-1].success

        graph.spin_until(too_large, "a log that is too large")
    sentence = f"{path} cannot be written: File too large"
    assert answers[-1].message == sentence
    assert [found.read_text() for found in path.parent.iterdir()] == ["older"]
    started.signal_group(signal.SIGINT)
    assert started.wait() == 0
    assert started.text().count(f"hrp2_sim_bridge: {sentence}") == 1
    assert "Traceback" not in started.text()
    assert "Exception" not in started.text()
    assert [found.read_text() for found in path.parent.iterdir()] == ["older"]


def test_the_recording_keeps_what_fits(
        start_process: Callable[..., Any], tmp_path: Path) -> None:
    """The recorder ends with a sentence; the first messages can be read, in order."""
    path = tmp_path / "run.mcap"
    started = start_process(limited(
        500, "run", "door_impact_bringup", "recorder", "--ros-args", "-p", f"file:={path}"))
    numbers, noise = count(), random.Random(0)
    with graph_of() as graph:
        texts = graph.node.create_publisher(String, "/text", 1000)

        def ended() -> bool:
            for _ in range(10):
                texts.publish(String(data=f"{next(numbers)} {noise.randbytes(500).hex()}"))
            return started.process.poll() is not None

        graph.spin_until(ended, "the end of the recorder")
    assert started.wait() == 1
    assert started.text().count(f"recorder: {path}: cannot be written: File too large") == 1
    assert "Traceback" not in started.text()
    with open_bag(path) as bag:
        chosen = [each for each in bag.connections if each.topic == "/text"]
        got = [int(bag.deserialize(data, each.msgtype).data.split()[0])
               for each, _, data in bag.messages(chosen)]
    assert len(got) > 100
    assert got == sorted(set(got))
