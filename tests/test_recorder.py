"""The node recorder as a process of its own, and how it ends."""

import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from door_model.recording.mcap import open_bag
from processes import GUARD
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import ConnectionExtRosbag2
from rosbags.rosbag2.storage_mcap import McapReader
from std_msgs.msg import String

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


@pytest.fixture
def talker() -> Iterator[Node]:
    """A node that publishes."""
    rclpy.init(args=[])
    node = Node("talker")
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def recorder(start: Callable[..., Any], path: Path) -> Any:
    """A recorder that records."""
    started = start("run", "door_impact_bringup", "recorder", "--ros-args", "-p", f"file:={path}")
    started.wait_for_text("recording to")
    return started


def publisher(node: Node, topic: str, qos: QoSProfile | int, kind: Any = String) -> Any:
    """A publisher that the recorder has found."""
    made = node.create_publisher(kind, topic, qos)
    end = time.monotonic() + GUARD
    while not made.get_subscription_count():
        assert time.monotonic() < end, f"nobody records {topic}"
        time.sleep(0.01)
    return made


def stop(started: Any, path: Path, topic: str, last: str) -> None:
    """End a recorder by Ctrl-C when the last text of a topic is in its file."""
    end = time.monotonic() + GUARD
    while heard(path, topic)[-1:] != [last]:
        assert time.monotonic() < end, f"{last!r} of {topic} was never recorded"
        time.sleep(0.1)
    started.signal_group(signal.SIGINT)
    assert started.wait() == 0, started.text()


def heard(path: Path, topic: str) -> list[str]:
    """Texts of a topic in a file, as far as it is written."""
    with open_bag(path) as bag:
        chosen = [each for each in bag.connections if each.topic == topic]
        assert len(chosen) <= 1
        return [bag.deserialize(data, each.msgtype).data
                for each, _, data in bag.messages(chosen)]


@pytest.mark.parametrize("qos", [QoSProfile(depth=2000), BEST_EFFORT], ids=["reliable", "sensor"])
def test_topics_that_appear_later_are_recorded_without_loss(
        start: Callable[..., Any], talker: Node, tmp_path: Path, qos: QoSProfile) -> None:
    """400 messages at 200 Hz, whatever quality of service their publisher offers."""
    path = tmp_path / "run.mcap"
    started = recorder(start, path)
    texts = publisher(talker, "/late", qos)
    for number in range(400):
        texts.publish(String(data=str(number)))
        time.sleep(0.005)
    stop(started, path, "/late", "399")
    assert heard(path, "/late") == [str(number) for number in range(400)]


@pytest.mark.parametrize("how", ["SIGTERM", "Ctrl-C twice", "SIGKILL"])
def test_the_file_can_be_read_however_the_recorder_ends(
        start: Callable[..., Any], talker: Node, tmp_path: Path, how: str) -> None:
    """While messages keep coming; a killed recorder's file may lack the last second of them."""
    path = tmp_path / "out" / "run.mcap"
    started = recorder(start, path)
    texts = publisher(talker, "/text", 1000)
    size, number, end = path.stat().st_size, 0, time.monotonic() + GUARD
    while number < 200 or path.stat().st_size == size:  # until there is a chunk
        assert time.monotonic() < end
        texts.publish(String(data=str(number)))
        number += 1
        time.sleep(0.002)
    for number in (signal.SIGINT,) * 2 if how == "Ctrl-C twice" else (getattr(signal, how),):
        started.signal_group(number)
    started.wait()  # ROS 2's `ros2 run` ends at once by a signal
    assert started.left_over() == []
    assert "Traceback" not in started.text()
    assert [found.name for found in path.parent.iterdir()] == ["run.mcap"]
    got = heard(path, "/text")
    assert got == [str(each) for each in range(len(got))]
    assert len(got) > 100 or (how == "SIGKILL" and got)


def test_rosbags_finds_index_quality_of_service_and_hash(
        start: Callable[..., Any], talker: Node, tmp_path: Path) -> None:
    """Also of what was latched before. `ros2 bag play` offers what the publisher offered."""
    path = tmp_path / "run.mcap"
    talker.create_publisher(String, "/latched", LATCHED).publish(String(data="text"))
    started = recorder(start, path)
    stop(started, path, "/latched", "text")
    reader = McapReader(path)
    reader.open()
    (topic,) = (each for each in reader.connections if each.topic == "/latched")
    assert topic.msgcount == 1
    assert isinstance(topic.ext, ConnectionExtRosbag2)
    (offer,) = topic.ext.offered_qos_profiles
    assert (offer.durability.name, offer.reliability.name) == ("TRANSIENT_LOCAL", "RELIABLE")
    assert STRING_HASH.encode() in reader.channels[topic.id].metadata
    reader.close()


def test_a_topic_of_two_types_brings_a_warning(
        start: Callable[..., Any], talker: Node, tmp_path: Path) -> None:
    """Whether the second type comes at once or later; the rest is recorded all the same.

    (Fast DDS takes no second type in the same process.)
    """
    talker.create_publisher(String, "/torn", 10)
    start("topic", "pub", "/torn", "diagnostic_msgs/msg/KeyValue", "{key: other}")
    path = tmp_path / "run.mcap"
    started = recorder(start, path)
    publisher(talker, "/whole", 10).publish(String(data="one"))
    started.wait_for_text("several types")
    stop(started, path, "/whole", "one")
    assert heard(path, "/whole") == ["one"]
