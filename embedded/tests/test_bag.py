"""`ros2 bag`: what it records, rosbags reads."""

import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from rclpy.qos import qos_profile_sensor_data
from ros2_embedded.bag_writer import BagWriter, full_definition
from ros2_embedded.catalogue import list_interfaces
from ros2_embedded.cli.bag_recorder import Choice
from ros2_embedded.typehash import type_hash
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.mark.usefixtures("peer")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_recording_is_complete_however_it_ends(
    start_ros2: Any, ros2: Ros2, tmp_path: Path, number: signal.Signals
) -> None:
    """Every topic, latched ones too, with what its publishers offer; Ctrl-C or SIGTERM gives 0."""
    bag = tmp_path / "run"
    recorder = start_ros2("bag", "record", "-a", "-o", str(bag))
    said = ""
    for line in recorder.stdout:
        said += line
        if "Recording..." in said and "Subscribed to topic '/latched'" in said:
            break
    ros2("topic", "echo", "--once", "/imu")
    recorder.send_signal(number)
    assert "Recording stopped" in recorder.stdout.read()
    assert recorder.wait(20) == 0
    with AnyReader([bag]) as reader:
        found = {c.topic: c for c in reader.connections}
        assert {"/heard", "/imu", "/joints", "/latched"} <= set(found)
        assert found["/latched"].ext.offered_qos_profiles[0].durability == (
            QosDurability.TRANSIENT_LOCAL
        )
        imu = found["/imu"]
        assert imu.ext.offered_qos_profiles[0].reliability == QosReliability.BEST_EFFORT
        assert imu.digest == type_hash("sensor_msgs/msg/Imu")
        (kept,) = reader.messages([found["/latched"]])
        assert reader.deserialize(kept[2], kept[0].msgtype).data == "kept"
        joints = [
            reader.deserialize(m[2], m[0].msgtype) for m in reader.messages([found["/joints"]])
        ]
        assert {tuple(message.position) for message in joints} == {(1.0, 2.5)}
    info = ros2("bag", "info", str(bag)).stdout
    assert info.startswith("\nFiles:             run_0.mcap\nBag size:          ")
    line = "Topic: /latched | Type: std_msgs/msg/String | Count: 1 | Serialization Format: cdr\n"
    assert line in info


def test_a_bag_carries_the_types_of_other_packages(tmp_path: Path) -> None:
    """Definitions with all that they refer to; hash, offers and metadata as rosbag2 has them."""
    kind = f"door_impact_msgs/msg/{list_interfaces('door_impact_msgs', 'msg')[0]}"
    writer = BagWriter(tmp_path / "b", compress=True, custom_data={"robot": "hrp2"})
    topic = writer.add_topic("/x", kind, [qos_profile_sensor_data])
    writer.write(topic, 5, b"\0\1\0\0")
    writer.close()
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(full_definition(kind), kind))
    assert store.hash_rihs01(kind) == type_hash(kind)
    metadata = yaml.safe_load((tmp_path / "b" / "metadata.yaml").read_text())
    facts = metadata["rosbag2_bagfile_information"]
    assert (facts["ros_distro"], facts["relative_file_paths"]) == ("jazzy", ["b_0.mcap"])
    assert facts["custom_data"] == {"robot": "hrp2"}
    with AnyReader([tmp_path / "b"]) as reader:
        (connection,) = reader.connections
        assert connection.digest == type_hash(kind)
        assert [(stamp, data) for _, stamp, data in reader.messages()] == [(5, b"\0\1\0\0")]


def test_a_bag_without_messages_can_be_read(tmp_path: Path, ros2: Ros2) -> None:
    """It has topics, and no duration."""
    writer = BagWriter(tmp_path / "b", compress=False, custom_data={})
    writer.add_topic("/x", "std_msgs/msg/String", [])
    writer.close()
    with AnyReader([tmp_path / "b"]) as reader:
        assert [c.topic for c in reader.connections] == ["/x"]
    assert "Duration:          0.000000000s\n" in ros2("bag", "info", str(tmp_path / "b")).stdout


@pytest.mark.parametrize(
    ("choice", "taken"),
    [
        (Choice(), set()),
        (Choice(every=True), {"/a", "/b/c"}),
        (Choice(every=True, without_topics=["/a"]), {"/b/c"}),
        (Choice(every=True, without_types=["T"]), {"/b/c"}),
        (Choice(every=True, without_regex="c$"), {"/a"}),
        (Choice(topics=["/a"]), {"/a"}),
        (Choice(types=["U"]), {"/b/c"}),
        (Choice(regex="b/"), {"/b/c"}),
        (Choice(topics=["/a"], regex="b/", without_regex="b"), {"/a"}),
    ],
)
def test_topics_are_chosen(choice: Choice, taken: set[str]) -> None:
    """By name, type and pattern; exclusions come last."""
    assert {
        name for name, kind in {"/a": "T", "/b/c": "U"}.items() if choice.takes(name, kind)
    } == (taken)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ([], "Need to specify at least one option out of --all, --all-topics, --all-services, "
             "--services, --topics, --topic-types or --regex"),
        (["--topics", "/a", "--exclude-topics", "/b"],
         "--exclude-topics argument requires either --all, --all-topics, --topic-types or --regex"),
        (["-a", "-o", "."], "Output folder '.' already exists."),
    ],
)  # fmt: skip
def test_recordings_that_make_no_sense(ros2: Ros2, arguments: list[str], error: str) -> None:
    """The error is rosbag2's."""
    done = ros2("bag", "record", *arguments)
    assert (done.returncode, done.stderr) == (1, f"[ERROR] [ros2bag]: {error}\n")
