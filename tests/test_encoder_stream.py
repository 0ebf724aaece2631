"""The encoder's stream between processes: from a recording or a board to /door_encoder/samples."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from door_impact_bringup.recorder_node import definition
from door_impact_common.stamps import stamp_of
from door_impact_msgs.msg import EncoderSamples
from door_model.recording.recording import write_counts_csv
from mcap.writer import Writer
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from running_graph import Graph, seconds

KIND = "door_impact_msgs/msg/EncoderSamples"
SAMPLES = 8_000
COUNTS = np.rint(400 * (1 - np.cos(np.maximum(0, np.arange(SAMPLES) - 500) * 2e-3))).astype(int)
Start = Callable[..., Any]


class Listener:
    """Hears /door_encoder/samples of a door_encoder that runs as a process.

    Attributes:
        heard: The messages.
        graph: The node of the tests.
    """

    def __init__(self, start: Start) -> None:
        self.heard: list[EncoderSamples] = []
        started = start("run", "door_encoder", "door_encoder", "--ros-args", "-p",
                        "counter_bits:=16")
        self.graph = Graph(started)
        node = self.graph.node
        node.create_subscription(EncoderSamples, "/door_encoder/samples", self.heard.append,
                                 QoSProfile(depth=2000))
        self.graph.spin_until(lambda: node.count_publishers("/door_encoder/samples"),
                              "/door_encoder/samples")

    def until(self, number: int) -> None:
        """Spins until a sample has come."""
        self.graph.spin_until(
            lambda: self.heard and self.heard[-1].first_index + len(self.heard[-1].counts) > number,
            f"sample {number}")

    def numbers(self) -> list[int]:
        """Running numbers of all samples, as they came."""
        return [message.first_index + place for message in self.heard
                for place in range(len(message.counts))]


@pytest.fixture
def listener(start: Start) -> Iterator[Listener]:
    rclpy.init(args=[])
    try:
        yield Listener(start)
    finally:
        rclpy.try_shutdown()


def test_no_sample_is_lost(start: Start, listener: Listener, tmp_path: Path) -> None:
    """Eight seconds at 1 kHz, played four times as fast through three processes: all, in order."""
    path = tmp_path / "door.csv"
    write_counts_csv(path, np.arange(SAMPLES) * 1e-3, COUNTS)
    player = start("run", "door_encoder", "play", "--csv", str(path), "--rate", "4")
    listener.until(SAMPLES - 1)
    assert player.wait() == 0
    assert "played 8000 samples in 400 batches" in player.text()
    assert listener.numbers() == list(range(SAMPLES))
    assert np.concatenate([message.counts for message in listener.heard]).tolist() == (
        COUNTS.tolist())
    assert not any(message.gap_before for message in listener.heard)


def test_a_recorded_stream_is_played_as_it_was(
        start: Start, listener: Listener, tmp_path: Path) -> None:
    """Batches of a file with their wraps, numbers and gaps; stamps keep their distances."""
    path = tmp_path / "door.mcap"
    raw = (COUNTS[:3000] + 65400) % 2**16
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema(KIND, "ros2msg", definition(KIND).encode())
        channel = writer.register_channel("/door_encoder/counts", "cdr", schema)
        for first in [*range(0, 1000, 20), *range(1100, 3000, 20)]:
            message = EncoderSamples(period=1e-3, first_index=first, counts_per_turn=14400,
                                     counts=raw[first:first + 20].tolist())
            message.header.stamp = stamp_of(first * 10**6)
            writer.add_message(channel, first, serialize_message(message), first)
        writer.finish()
    start("run", "door_encoder", "play", "--mcap", str(path))
    listener.until(2999)
    assert listener.numbers() == [*range(1000), *range(1100, 3000)]
    gaps = [message.first_index for message in listener.heard if message.gap_before]
    assert gaps == [1100]
    for message in listener.heard:
        assert list(message.counts) == COUNTS[message.first_index:][:20].tolist()
    first, last = listener.heard[0], listener.heard[-1]
    assert seconds(last.header.stamp) - seconds(first.header.stamp) == pytest.approx(2.98)


def test_a_board_becomes_an_angle(start: Start, listener: Listener) -> None:
    """The simulated board, polled: counts of a door, each missing number behind a gap."""
    start("run", "door_encoder", "counter_board", "--ros-args", "-p",
          "board:=door_encoder.simulated_board:SimulatedBoard")
    listener.graph.spin_until(lambda: listener.heard and max(listener.heard[-1].counts) >= 700,
                              "an open door")
    ends = [message.first_index + len(message.counts) for message in listener.heard]
    for end, message in zip(ends, listener.heard[1:], strict=False):
        assert message.gap_before == (message.first_index > end)
    for message in listener.heard:
        assert min(message.counts) >= -1
        assert len(message.counts) == 1 or np.abs(np.diff(message.counts)).max() <= 3
