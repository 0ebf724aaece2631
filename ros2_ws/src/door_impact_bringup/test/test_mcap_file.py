"""One MCAP file: what is in it, when it is there, and what is refused."""

from pathlib import Path

import pytest
from door_impact_bringup.errors import RecordingError
from door_impact_bringup.mcap_file import McapFile, partial_folder
from door_impact_common.errors import SettingError
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
STRING = "std_msgs/msg/String"
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
FOREVER = QosTime(9223372036, 854775807)
LATCHED = Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL,
              FOREVER, FOREVER, QosLiveliness.AUTOMATIC, FOREVER, False)


def cdr(text: str) -> bytes:
    """A String on the wire."""
    return bytes(STORE.serialize_cdr(STORE.types[STRING](data=text), STRING))


def written(path: Path, texts: dict[int, str]) -> Path:
    """A file with texts at times [ns]."""
    file = McapFile(path)
    topic = file.add_topic("/text", STRING, STORE, [LATCHED])
    for stamp, text in texts.items():
        file.write(topic, stamp, cdr(text))
    file.close()
    return path


def test_messages_come_back_with_their_times(tmp_path: Path) -> None:
    """Topic, type, stamps in nanoseconds and contents are what was written."""
    path = written(tmp_path / "run.mcap", {5: "five", 1_000_000_007: "later"})
    with AnyReader([path], default_typestore=STORE) as reader:
        heard = [(c.topic, t, reader.deserialize(data, c.msgtype).data)
                 for c, t, data in reader.messages()]
    assert heard == [("/text", 5, "five"), ("/text", 1_000_000_007, "later")]


def test_the_file_carries_definition_hash_and_quality_of_service(tmp_path: Path) -> None:
    """A reader without ROS 2 can decode it, and `ros2 bag play` offers what was offered."""
    path = written(tmp_path / "run.mcap", {1: "one"})
    reader = McapReader(path)
    reader.open()
    (topic,) = reader.connections
    assert topic.msgdef.data == "string data\n"
    assert topic.ext.offered_qos_profiles == [LATCHED]
    (channel,) = reader.channels.values()
    assert b"topic_type_hash" in channel.metadata
    assert STRING_HASH.encode() in channel.metadata
    reader.close()


def test_one_file_is_left_and_only_when_it_is_complete(tmp_path: Path) -> None:
    """Until `close` there is only the unfinished folder; afterwards there is only the file."""
    path = tmp_path / "deep" / "run.mcap"
    file = McapFile(path)
    assert not path.exists()
    assert partial_folder(path).is_dir()
    file.close()
    assert [found.name for found in path.parent.iterdir()] == ["run.mcap"]


def test_a_recording_without_messages_is_a_file(tmp_path: Path) -> None:
    """It opens, names its topic and starts at time zero."""
    path = written(tmp_path / "run.mcap", {})
    with AnyReader([path], default_typestore=STORE) as reader:
        assert [(c.topic, c.msgcount) for c in reader.connections] == [("/text", 0)]
        assert list(reader.messages()) == []


def test_long_recordings_go_to_disk_in_chunks(tmp_path: Path) -> None:
    """After 8 MB of messages at most one chunk of 1 MiB is in memory."""
    file = McapFile(tmp_path / "run.mcap")
    topic = file.add_topic("/text", STRING, STORE, [])
    data = cdr("x" * 1000)
    for stamp in range(8000):
        file.write(topic, stamp, data)
    pending = file._writer.storage.chunk.bio.tell()
    file.close()
    assert pending <= 2**20 + len(data)
    with AnyReader([tmp_path / "run.mcap"], default_typestore=STORE) as reader:
        assert sum(1 for _ in reader.messages()) == 8000


@pytest.mark.parametrize("there", ["run.mcap", "run.mcap.partial"])
def test_what_exists_is_not_overwritten(tmp_path: Path, there: str) -> None:
    """Neither a recording nor what a killed recorder left; the error names it."""
    (tmp_path / there).write_text("precious")
    with pytest.raises(RecordingError, match=f"{there}: exists already"):
        McapFile(tmp_path / "run.mcap")
    assert (tmp_path / there).read_text() == "precious"


def test_an_impossible_place_is_an_error(tmp_path: Path) -> None:
    """A folder that is a file: the error names the recording and the reason."""
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match=r"run\.mcap: cannot be written: Not a dir"):
        McapFile(tmp_path / "file" / "run.mcap")


@pytest.mark.parametrize("name", ["run", "run.bag", ".mcap"])
def test_only_mcap_files_are_written(tmp_path: Path, name: str) -> None:
    """Another ending, or nothing before it, is refused."""
    with pytest.raises(SettingError, match=r"\.mcap") as caught:
        McapFile(tmp_path / name)
    assert caught.value.setting == "file"
