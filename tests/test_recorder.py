"""The node recorder as a process of its own, and how it ends."""

import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from door_model.recording.mcap import open_bag
from processes import GUARD, Started, find_ros2
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import ConnectionExtRosbag2
from rosbags.rosbag2.storage_mcap import McapReader
from std_msgs.msg import String

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


class Recorders:
    """A node that publishes, and recorders of what it does."""

    def __init__(self, folder: Path) -> None:
        self.node, self.folder = Node("talker"), folder
        self.started: list[Started] = []

    def start(self, *arguments: str) -> Started:
        """Start `ros2 ...`."""
        self.started.append(Started(
            [find_ros2(), *arguments], self.folder / f"{len(self.started)}.txt"))
        return self.started[-1]

    def record(self, path: Path) -> Started:
        """A recorder that records."""
        return self.start("run", "door_impact_bringup", "recorder", "--ros-args", "-p",
                          f"file:={path}").wait_for_text("recording to")

    def publisher(self, topic: str, qos: QoSProfile | int) -> Any:
        """A publisher that the recorder has found."""
        made = self.node.create_publisher(String, topic, qos)
        end = time.monotonic() + GUARD
        while not made.get_subscription_count():
            assert time.monotonic() < end, f"nobody records {topic}"
            time.sleep(0.01)
        return made


@pytest.fixture(scope="module")
def recorders(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recorders]:
    rclpy.init(args=[])
    made = Recorders(tmp_path_factory.mktemp("recorders"))
    try:
        yield made
    finally:
        for started in made.started:
            started.clean_up()
        made.node.destroy_node()
        rclpy.try_shutdown()


@pytest.fixture(scope="module")
def path(recorders: Recorders) -> Path:
    """A file of topics that were there before the recorder, and of some that came after it.

    (Fast DDS takes no second type of a topic in the same process.)
    """
    path = recorders.folder / "run.mcap"
    recorders.node.create_publisher(String, "/latched", LATCHED).publish(String(data="text"))
    recorders.node.create_publisher(String, "/torn", 10)
    recorders.start("topic", "pub", "/torn", "diagnostic_msgs/msg/KeyValue", "{key: other}")
    started = recorders.record(path)
    late = [recorders.publisher("/reliable", QoSProfile(depth=2000)),
            recorders.publisher("/sensor", BEST_EFFORT)]
    for number in range(400):
        for each in late:
            each.publish(String(data=str(number)))
        time.sleep(0.005)
    started.wait_for_text("several types")
    end = time.monotonic() + GUARD
    while any(heard(path, topic)[-1:] != ["399"] for topic in ("/reliable", "/sensor")):
        assert time.monotonic() < end, "the last text was never recorded"
        time.sleep(0.1)
    started.signal_group(signal.SIGINT)
    assert started.wait() == 0, started.text()
    return path


def heard(path: Path, topic: str) -> list[str]:
    """Texts of a topic in a file, as far as it is written."""
    with open_bag(path) as bag:
        chosen = [each for each in bag.connections if each.topic == topic]
        assert len(chosen) <= 1
        return [bag.deserialize(data, each.msgtype).data
                for each, _, data in bag.messages(chosen)]


@pytest.mark.parametrize("topic", ["/reliable", "/sensor"])
def test_topics_that_appear_later_are_recorded_without_loss(path: Path, topic: str) -> None:
    """400 messages at 200 Hz, whatever quality of service their publisher offers.

    A topic of two types, which has brought a warning, is no hindrance.
    """
    assert heard(path, topic) == [str(number) for number in range(400)]


def test_rosbags_finds_index_quality_of_service_and_hash(path: Path) -> None:
    """Also of what was latched before. `ros2 bag play` offers what the publisher offered."""
    reader = McapReader(path)
    reader.open()
    (topic,) = (each for each in reader.connections if each.topic == "/latched")
    assert topic.msgcount == 1
    assert isinstance(topic.ext, ConnectionExtRosbag2)
    (offer,) = topic.ext.offered_qos_profiles
    assert (offer.durability.name, offer.reliability.name) == ("TRANSIENT_LOCAL", "RELIABLE")
    assert STRING_HASH.encode() in reader.channels[topic.id].metadata
    reader.close()


@pytest.mark.parametrize("how", [(signal.SIGTERM,), (signal.SIGINT,) * 2, (signal.SIGKILL,)])
def test_the_file_can_be_read_however_the_recorder_ends(
        recorders: Recorders, tmp_path: Path, how: tuple[signal.Signals, ...]) -> None:
    """While messages keep coming; a killed recorder's file may lack the last second of them."""
    path = tmp_path / "out" / "run.mcap"
    started = recorders.record(path)
    texts = recorders.publisher("/text", 1000)
    number, end = 0, time.monotonic() + GUARD
    while number < 200 or number % 50 or not heard(path, "/text"):  # until there is a chunk of it
        assert time.monotonic() < end
        texts.publish(String(data=str(number)))
        number += 1
        time.sleep(0.002)
    for signal_number in how:
        started.signal_group(signal_number)
    started.wait()  # ROS 2's `ros2 run` ends at once by a signal
    assert started.left_over() == []
    assert "Traceback" not in started.text()
    assert [found.name for found in path.parent.iterdir()] == ["run.mcap"]
    got = heard(path, "/text")
    assert got == [str(each) for each in range(len(got))]
    assert len(got) > 100 or (how == (signal.SIGKILL,) and got)
    recorders.node.destroy_publisher(texts)
